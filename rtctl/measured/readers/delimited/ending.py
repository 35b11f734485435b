"""End of a text file: a last line that was cut off while it was written, and empty rows that spreadsheets add."""

from __future__ import annotations

import re
from typing import NamedTuple

from rtctl.measured.readers.delimited.form import Form, cells_of
from rtctl.measured.readers.delimited.text import Text

_NEIGHBOURS, _FEWEST = 50, 5
"""Lines that the last one is held against: at most, and at least."""
_SHORT_EXPONENT = re.compile(r"[eE][+-]?\d?$")
_WHOLE_EXPONENT = re.compile(r"[eE][+-]?\d\d+$")


class Ending(NamedTuple):
    """Rows at the end that are no readings."""

    rows: int
    """Number of them."""
    remark: str
    """Why they are left out; "": none is."""
    cut_bytes: int = 0
    """Bytes of a line that was cut off, which may not be readable."""


def find_ending(text: Text, form: Form, rows: int) -> Ending:
    """Return the rows at the end of a file of `rows` rows that are no readings."""
    tail = text.tail()
    has_end = tail.rstrip(b" \t").endswith((b"\n", b"\r"))
    lines = [line.decode("latin-1") for line in tail.splitlines() if line.strip()][-(_NEIGHBOURS + 1) :]
    lines = lines[-rows:] if rows else []
    empty = 0
    while lines and not lines[-1].strip(f"{form.separator} \t"):
        lines.pop()
        empty += 1
    if empty:
        return Ending(empty, f"{empty} empty {'row' if empty == 1 else 'rows'} at the end left out")
    why = "" if has_end or not lines else _cut_off([cells_of(line, form.separator) for line in lines], form)
    if not why:
        return Ending(0, "")
    remark = f"the last line has no end and {why}: taken as cut off, and left out"
    return Ending(1, remark, len(tail.splitlines()[-1]))


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
