"""How far the opening lines of a text file go: until they show the columns, below a preamble of any usual length."""

from __future__ import annotations

from rtctl.measured.readers.delimited.field_rows import check_no_field_rows
from rtctl.measured.readers.delimited.form import Form, find_form
from rtctl.measured.readers.delimited.names import BLANKS, SEPARATORS, cells_of, is_number
from rtctl.measured.readers.delimited.text import BLOCK_BYTES, Text
from rtctl.measured.readers.stated.preamble import NumberedLine

OPENING_LINES = (300, 1200, 5000)
"""Lines over which the form is sought; each is tried where those before it do not show what the last lines are."""
REMEDY = "remove what stands above the line that names the columns"
_LAST = 50
"""Lines at the end of the file that the form is held against; lines that are no preamble."""
_READING = frozenset("0123456789+-.")
"""Beginnings of numbers, dates and clock times."""


def find_opening(text: Text) -> tuple[list[NumberedLine], Form]:
    """Return the opening lines of a file and its form, as they show it. Raises ValueError in words."""
    first: tuple[list[NumberedLine], Form] | None = None
    wrong: ValueError | None = None
    check_no_field_rows([line.text for line in text.opening(1)])
    for size in OPENING_LINES:
        opening = text.opening(size)
        try:
            found = opening, find_form([line.text for line in opening])
        except ValueError as error:
            wrong = wrong or error
        else:
            first = first or found
            if found is not first and _has_rows_above(*found, first[1].separator):
                return first  # another table: its place is told when it is read
            if len(opening) < size or _agrees(found[1], text):
                return found
        if len(opening) < size:
            break
    if first is not None and (len(first[1].names) > 1 or len(opening) < size):
        return first
    if wrong is not None and len(opening) < size:
        raise wrong
    raise ValueError(f"no columns of numbers are found in its first {size} lines: {REMEDY}")


def _agrees(form: Form, text: Text) -> bool:
    """Return whether most of the last lines have as many cells as the form has columns; of one column: no numbers."""
    tail = text.tail()
    lines = [line.decode("latin-1") for line in tail.splitlines() if line.strip()]
    lines = lines[len(tail) >= BLOCK_BYTES :][-_LAST:]  # without the part of a line
    if len(form.names) == 1:
        return not any(
            2 * sum(_has_numbers(line, one) for line in lines) > len(lines) for one in (*SEPARATORS, BLANKS)
        )
    alike = sum(len(cells_of(line, form.separator)) == len(form.names) for line in lines)
    return 2 * alike >= len(lines)


def _has_rows_above(opening: list[NumberedLine], form: Form, separator: str) -> bool:
    """Return whether so many lines above the columns look like rows of readings that they are no preamble."""
    lines = [cells_of(line.text, separator) for line in opening[: form.head]]
    return sum(sum(cell[:1] in _READING for cell in cells if cell) > 1 for cells in lines) > _LAST


def _has_numbers(line: str, separator: str) -> bool:
    """Return whether a line has several numbers between separators."""
    return sum(is_number(cell) for cell in cells_of(line, separator)) > 1
