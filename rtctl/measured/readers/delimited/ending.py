"""End of a text file: comments and empty rows below the numbers, a last line that was cut off, lines of words."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import NamedTuple

from rtctl.measured.readers.delimited.form import Form
from rtctl.measured.readers.delimited.names import cells_of, is_number
from rtctl.measured.readers.delimited.text import Text
from rtctl.measured.readers.delimited.words import COMMENTS, is_gap, shown

_NEIGHBOURS, _FEWEST = 50, 5
"""Lines that the last one is held against: at most, and at least."""
_SHORT_EXPONENT = re.compile(r"[eE][+-]?\d?$")
_WHOLE_EXPONENT = re.compile(r"[eE][+-]?\d\d+$")
_MARK = re.compile(r"[^\w\s\"+\-.,]+")
"""Signs at the beginning of a line with which no reading begins."""
_READING = frozenset("0123456789+-.,")
"""Beginnings of numbers, dates and clock times."""


class Ending(NamedTuple):
    """Rows at the end that are no readings."""

    rows: int
    """Number of them."""
    remark: str
    """Why they are left out; "": none is."""
    cut_bytes: int = 0
    """Bytes of comments, or of a line that was cut off, which may not be readable."""


def find_ending(text: Text, form: Form, rows: int, above: Collection[str] = ()) -> Ending:
    """Return the rows at the end of a file of `rows` rows that are no readings.

    Args:
        text: The lines of the file.
        form: Their form.
        rows: Number of lines below the head that are not blank.
        above: Lines of the head; the marks of their comments are those of comments at the end.

    Raises:
        ValueError: Lines of words stand below the numbers.
    """
    lines = text.tail().splitlines(keepends=True)
    below, empty, cut_bytes = _pop_comments(lines, form, rows, _marks(above, form.separator))
    comments = len(below)
    lines = [line for line in lines if line.strip()][-(_NEIGHBOURS + 1) :]
    left = rows - comments - empty
    last = [line.decode("latin-1").rstrip("\r\n") for line in lines[-left:]] if left > 0 else []
    has_end = not lines or lines[-1].endswith((b"\n", b"\r"))
    why = "" if has_end or not last else _cut_off([cells_of(line, form.separator) for line in last], form)
    remarks = [
        f"{empty} empty {'row' if empty == 1 else 'rows'} at the end left out" if empty else "",
        _about_comments(below),
    ]
    if not why:
        _check_words(text, last, form, below=comments + empty)
        return Ending(comments + empty, "; ".join(one for one in remarks if one), cut_bytes)
    remark = f"the last line has no end and {why}: taken as cut off, and left out"
    return Ending(
        comments + empty + 1, "; ".join(one for one in (*remarks, remark) if one), cut_bytes + len(lines[-1])
    )


def _marks(above: Collection[str], separator: str) -> tuple[str, ...]:
    found = [one[0] for line in above if (one := _MARK.match(line.strip())) and one[0][0] != separator]
    return (*COMMENTS, *dict.fromkeys(found))


def _pop_comments(
    lines: list[bytes], form: Form, rows: int, marks: tuple[str, ...]
) -> tuple[list[str], int, int]:
    """Take comments and empty rows from the end of lines.

    Returns:
        Comments, the last one first, number of empty rows, and bytes from the first comment on; none of them where
        every row begins so.
    """
    whole, comments = list(lines), list[str]()
    empty = popped = cut_bytes = 0
    while lines and len(comments) + empty < rows:
        words = lines[-1].decode("latin-1").rstrip("\r\n")
        first = next(iter(cells_of(words, form.separator)), "")
        is_comment = words.lstrip().startswith(marks) and not is_gap(first)
        if words and not words.strip(f"{form.separator} \t"):
            empty += 1
        elif is_comment:
            comments.append(words)
        elif words.strip():
            break
        popped += len(lines.pop())
        cut_bytes = popped if is_comment else cut_bytes
    if len(comments) > _NEIGHBOURS or (comments and len(comments) + empty == rows):  # labels of rows: #1, #2
        lines[:] = whole
        return [], 0, 0
    return comments, empty, cut_bytes


def _about_comments(comments: Sequence[str]) -> str:
    """Return what is told of comments below the numbers, which may say something of these; "": there are none."""
    if not comments:
        return ""
    count = "1 comment" if len(comments) == 1 else f"{len(comments)} comments"
    return f'{count} below the numbers left out, "{shown(comments[-1])}"{" first" * (len(comments) > 1)}'


def _check_words(text: Text, last: Sequence[str], form: Form, below: int) -> None:
    """Raise ValueError where the last lines begin with a word, above which the first column went on as a time does.

    Where it did not, it may hold marks, `0, 0, up`: with numbers behind them these lines are readings.
    """
    firsts = [next(iter(cells_of(line, form.separator)), "") for line in last]
    count = 0
    while count < len(firsts) and _is_word(firsts[-1 - count]):
        count += 1
    before = firsts[: len(firsts) - count]
    if not count or len(before) < _FEWEST or not all(one[:1] in _READING for one in before if one):
        return
    line = last[len(before)]
    has_numbers = any(is_number(cell) for cell in cells_of(line, form.separator)[1:])
    if has_numbers and not _increases(before):
        return
    number = text.line_number(below + count)
    raise ValueError(
        f'line {number}, "{shown(line)}", holds text below the numbers, and is no row of readings: remove it'
        f"{' and what follows' if count > 1 else ''}, or write # in front of {'each' if count > 1 else 'it'} (comments "
        "at the end are left out)"
    )


def _increases(cells: Sequence[str]) -> bool:
    """Return whether cells are numbers that increase, or dates or clock times, which increase as text."""
    filled = [cell.replace(",", ".") for cell in cells if cell]
    if not all(map(is_number, filled)):
        return not any(cell.isalnum() for cell in filled) and filled == sorted(filled)
    numbers = [float(cell) for cell in filled]
    return all(one < other for one, other in pairwise(numbers))


def _is_word(cell: str) -> bool:
    return bool(cell) and cell[0] not in _READING and not is_number(cell) and not is_gap(cell)


def _cut_off(rows: list[list[str]], form: Form) -> str:
    """Return why the last row looks cut off, as the end of a sentence; "": it does not."""
    *before, last = rows
    if len(last) < len(form.names):
        return f"only {len(last)} of {len(form.names)} columns"
    neighbours = [row[-1] for row in before if len(row) == len(form.names) and row[-1]]
    if len(neighbours) < _FEWEST:
        return ""
    fewest = min(len(cell) for cell in neighbours)
    if len(last[-1]) < fewest:
        return f'its last number, "{last[-1]}", has fewer characters than any before it ({fewest})'
    if (
        _SHORT_EXPONENT.search(last[-1])
        and all(_WHOLE_EXPONENT.search(cell) for cell in neighbours if "e" in cell.lower())
        and any("e" in cell.lower() for cell in neighbours)
    ):
        return f'the exponent of its last number, "{last[-1]}", is not whole'
    return ""
