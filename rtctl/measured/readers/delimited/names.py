"""Names of columns in lines above the numbers: a comment, a line with a label, one a line, or between blanks.

`# t in s; x in um`, `# columns: t, x`, `# col 1: t [s]` above `# col 2: x [um]`, `t [s]   x [um]`.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import NamedTuple

from rtctl.measured.readers.delimited.words import COMMENTS
from rtctl.measured.stated_unit import is_common, is_no_unit, readable, unit_in_name

BLANKS = " "
"""Separator of columns that any number of blanks and tabs separates."""
SEPARATORS: tuple[str, ...] = (";", "\t", ",")
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*|,\d+)?|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?inf(inity)?|nan", re.IGNORECASE)
_MARK = re.compile(r"\s*(?:[#%!;*']+(?=\s)|#+|//+)\s*")
"""A mark of a comment in front of names."""
_LABEL = re.compile(
    r"(?:column|col|field|channel|variable|spalte|kanal|colonne)(?:s|n|\s*names?)?\s*[:=]\s*(?=\S)|"
    r"(?:names|kanäle|kanaele|legend)\s*[:=]\s*(?=\S)",
    re.IGNORECASE,
)
_OF_COLUMNS = re.compile(r"col|field|var|spalte", re.IGNORECASE)
"""Beginnings of labels that can mean nothing but columns; a list of channels may have others, or another order."""
_UNITS_LABEL = re.compile(r"(?:units?|einheit(?:en)?|unités?)\s*[:=]\s*(?=\S)", re.IGNORECASE)
_NUMBERED = re.compile(
    r"(?:(?:col(?:umn)?|ch(?:annel)?|field|var(?:iable)?|spalte|kanal)?[\s_.#]*(?P<number>\d{1,3}))\s*[:=)]\s*(?P<name>\S.*)",
    re.IGNORECASE,
)


class Named(NamedTuple):
    """What lines above the numbers say of the columns."""

    names: list[str]
    """Names by column; []: the lines have units alone."""
    units: list[str]
    """Units by column; []: the lines have none."""


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line, without blanks and quotes around."""
    if separator == BLANKS:
        return line.split()
    try:
        (row,) = csv.reader([line], delimiter=separator, skipinitialspace=True) if line else ([],)
    except (csv.Error, ValueError):
        row = line.split(separator)
    return [cell.strip() for cell in row]


def joined_brackets(cells: Sequence[str], separator: str, line: str) -> list[str]:
    """Return the cells of a line with those joined that a separator within brackets divides: `t (ms, UTC+1)`."""
    found: list[str] = []
    for cell in cells:
        if found and _is_open(found[-1]):
            spaced = f"{found[-1]}{separator} {cell}"
            found[-1] = spaced if spaced in line else f"{found[-1]}{separator}{cell}"
        else:
            found.append(cell)
    return found


def _is_open(cell: str) -> bool:
    return any(cell.count(left) > cell.count(right) for left, right in ("()", "[]"))


def is_number(text: str) -> bool:
    """Return whether a cell holds a number, with decimal point or comma."""
    return _NUMBER.fullmatch(text) is not None


def bare_unit(cell: str) -> str:
    """Return a cell of a row of units without brackets."""
    return cell.strip("[]() ") if cell[:1] in ("[", "(") else cell


def without_mark(line: str) -> str:
    """Return a line without the mark of a comment at its beginning."""
    return _MARK.sub("", line, count=1) if _MARK.match(line) else line


def spaced_names(line: str, columns: int) -> list[str] | None:
    """Return names between blanks, units and words of several parts with them; None: they are not so many.

    The parts are taken as names where there are as many, else what stands between two blanks or more, else names with
    the brackets behind them.
    """
    text = without_mark(line).strip()
    quoted = re.findall(r'"[^"]+"|\S+', text)
    splits = (
        [one.strip('"') for one in quoted] if '"' in text else text.split(),
        re.split(r"\s{2,}|\t", text),
        re.split(r"\s+(?![\[(/])", text),
        [one.strip() for one in re.findall(r"[^\[(]+[\[(][^\])]*[\])]", text)],
    )
    for parts in splits:
        names = [one.rstrip(",;") for one in parts]
        if len(names) == columns and all(one and not _is_no_name(one) for one in names):
            return names
    return None


def names_above(lines: Sequence[str], separator: str, columns: int) -> Named | None:
    """Return what lines above the numbers say of the columns; None: they name none.

    They may stand between other separators than the numbers do. Of several, those with units right above the numbers
    come first, then those that are called columns, then others right above the numbers, and lists of channels last.
    """
    strong, near, weak = list[list[str]](), list[list[str]](), list[list[str]]()
    """Cells of lines with a label, of comments right above the numbers, and of lists of channels, the last first."""
    units, is_labelled = list[str](), False
    lines = [line for line in lines if any(one.isalnum() for one in line)]
    numbered = _one_a_line(lines, columns)
    for k in range(len(lines) - 1, -1, -1):
        text = without_mark(lines[k].lstrip("#% "))
        label, of_units = _LABEL.match(text), _UNITS_LABEL.match(text)
        is_near = k >= len(lines) - 2 and all(line.startswith(COMMENTS) for line in lines[k:])
        if not (label or of_units or is_near) or (numbered is not None and _NUMBERED.fullmatch(text)):
            continue
        begin = next((one.end() for one in (label, of_units) if one), 0)
        found = _split(text[begin:], separator, columns)
        if found is None:
            continue
        if of_units or (not label and not units and _are_units(found)):
            units = units or [bare_unit(one) for one in found]
            is_labelled = bool(of_units)
        elif label:
            (strong if _OF_COLUMNS.match(text) else weak).append(found)
        else:
            near.append(found)
    if numbered is not None:
        (strong if numbered.are_columns else weak).append(numbered.names)
    with_units = [one for one in near if any(unit_in_name(cell) for cell in one)]
    chosen = next(iter([*with_units, *strong, *near, *weak]), None)
    if chosen is not None:
        return Named(chosen, units)
    if not units:
        return None
    return Named([], units) if is_labelled else Named(units, [])  # `# V, A`: names that are units


def _are_units(cells: Sequence[str]) -> bool:
    bare = [bare_unit(one) for one in cells]
    return all(readable(one) or is_no_unit(one) for one in bare) and 2 * sum(map(is_common, bare)) >= len(
        bare
    )


class _OneALine(NamedTuple):
    names: list[str]
    are_columns: bool
    """Whether the lines say that they are of columns."""


def _one_a_line(lines: Sequence[str], columns: int) -> _OneALine | None:
    """Return the names of lines that are numbered from 0 or 1, one line a column; None: there are none.

    Lines that do not say what they number may be notes: one of them has a unit, or each is a single word.
    """
    found: dict[int, re.Match[str]] = {}
    for line in lines:
        one = _NUMBERED.fullmatch(without_mark(line.lstrip("#% ")).strip())
        if one is not None:
            found[int(one["number"])] = one
    first = min(found, default=0)
    if len(found) < 2 or first > 1 or sorted(found) != list(range(first, first + columns)):
        return None
    names = [found[k]["name"].strip() for k in sorted(found)]
    are_columns = all(_OF_COLUMNS.match(one[0]) for one in found.values())
    are_names = any(unit_in_name(one) for one in names) or not any(" " in one for one in names)
    if any(map(_is_no_name, names)) or not (are_columns or are_names):
        return None
    return _OneALine(names, are_columns)


def _split(text: str, separator: str, columns: int) -> list[str] | None:
    own = [separator] if separator != BLANKS else []  # between blanks, `a, b` is not `a,` and `b`
    for one in (*own, *SEPARATORS, "|"):
        cells = cells_of(text.strip().rstrip(one), one)
        names = _without_numbers(joined_brackets(cells, one, text) if len(cells) > columns else cells)
        if len(names) == columns and not any(_is_no_name(name) for name in names):
            return names
    spaced = spaced_names(text, columns)
    if separator == BLANKS or (spaced and any(unit_in_name(name) for name in spaced)):
        return spaced
    return None


def _without_numbers(names: list[str]) -> list[str]:
    """Return names without the numbers of their columns: `col 1: time [s]` as `time [s]`."""
    found = [_NUMBERED.fullmatch(name) for name in names]
    numbers = [int(one["number"]) for one in found if one]
    if len(numbers) == len(names) > 1 and numbers == list(range(numbers[0], numbers[0] + len(names))):
        return [one["name"].strip() for one in found if one]
    return names


def _is_no_name(cell: str) -> bool:
    return is_number(cell) or (cell[:1] in ("[", "(") and cell[-1:] in ("]", ")"))
