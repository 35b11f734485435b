"""Form of the lines of a text file: separator, decimal mark, names, units, and the line at which the numbers begin.

It is decided over the opening lines (`opening`). The line right above the numbers names the columns, unless it gives
their units; what is above that is a preamble. Columns that no line names are `column_1`, `column_2` and so on.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from rtctl.measured.readers.delimited.labview import below_heads
from rtctl.measured.readers.delimited.levels import is_of_columns, without_levels
from rtctl.measured.readers.delimited.names import (
    BLANKS,
    SEPARATORS,
    Named,
    bare_unit,
    cells_of,
    is_number,
    joined_brackets,
    names_above,
    spaced_names,
    without_mark,
)
from rtctl.measured.readers.delimited.words import COMMENTS, shown
from rtctl.measured.readers.stated.preamble import states_rate
from rtctl.measured.stated_unit import is_common, is_no_unit, readable, stated_amplitude, unit_in_name

NAMELESS = "column_"
"""Beginning of the names of columns where no line names them: `column_1`, `column_2`."""
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_SEP_LINE = re.compile(r'"?sep=(.)"?\s*$', re.IGNORECASE)
_RATE = re.compile(r"\d[\d.,]*\s*[kM]?(Hz|S/s|Sa/s)")
_DRAWN = re.compile(r"[#%]|[#%]?[-=_+|]{2,}")
"""A line drawn below names, and a mark in front of it."""
_COMMENT = re.compile(r"(comment|note|remark|bemerkung|kommentar|event|marker)s?", re.IGNORECASE)
"""A last name of what is written beside few rows: the others do not have its cell."""
_TYPES = frozenset(
    [
        "double",
        "single",
        "float",
        "float32",
        "float64",
        "int",
        "int16",
        "int32",
        "int64",
        "integer",
        "real",
        "numeric",
    ]
)
"""Types of numbers as a row below the names gives them."""


class Form(NamedTuple):
    """Form of the lines of a file."""

    names: tuple[str, ...]
    """Names of all columns, without blanks around; "" where a column has none."""
    units: tuple[str, ...]
    """Units by column from a row of its own; empty: there is no such row."""
    head: int
    """Number of lines before the numbers, blank ones not counted."""
    separator: str
    decimal: str
    surplus: str = ""
    """First name for which the rows have no cell, where it is no place for comments; "": there is none."""


class _Layout(NamedTuple):
    """Lines as cells of one separator, and where its numbers begin."""

    rows: list[list[str]]
    columns: int
    first: int
    """The first line of numbers."""
    numeric: list[int]
    """Columns of numbers."""

    def has_numbers(self, row: list[str]) -> bool:
        """Return whether a row has a number in a column of numbers."""
        return any(is_number(row[k]) for k in self.numeric if k < len(row))

    def has_units(self, row: list[str]) -> bool:
        """Return whether a row has units, and no number, above the columns of numbers."""
        cells = [row[k] for k in self.numeric if k < len(row)]
        return not self.has_numbers(row) and _common_units(cells) > 0 and _are_units(cells)


def find_form(lines: Sequence[str]) -> Form:
    """Return the form of a file by its opening lines, none of them blank. Raises ValueError in words.

    A line that states the sample rate, or scales and limits of the columns, is no row of names, units or numbers,
    wherever above the numbers it stands.
    """
    apart = [k for k, line in enumerate(lines) if states_rate(line) or is_of_columns(line)]
    borders = [k - before for before, k in enumerate(apart)]
    form = _find_form([line for k, line in enumerate(lines) if k not in apart], borders)
    head = form.head
    for k in apart:
        head += k <= head
    if form.surplus:
        raise ValueError(
            f'the line above the numbers has more names than their {len(form.names)} columns, up to "{form.surplus}": '
            "which name is of which column does not show; write one name a column"
        )
    return form._replace(head=head)


def _find_form(lines: Sequence[str], borders: Sequence[int]) -> Form:
    """Return the form of lines; names and units do not stand on two sides of a border."""
    start, separators = 0, SEPARATORS
    if lines and (told := _SEP_LINE.match(lines[0])):
        start, separators = 1, (str(told[1]),)
    start = max(start, below_heads(lines))
    while start < len(lines) and lines[start].startswith(COMMENTS):
        start += 1
    if start >= len(lines):
        raise ValueError("the header line is empty; the first line must name the columns")
    forms = [form for one in separators if (form := _form_by(lines, start, one, borders)) is not None]
    if forms:
        return max(forms, key=lambda form: len(form.names))
    spaced = _form_by(lines, start, BLANKS, borders) if len(separators) > 1 else None
    if spaced is None and len(separators) > 1:
        _check_names(lines, start)
    return spaced or _plain_form(lines, start, separators)


def _check_names(lines: Sequence[str], start: int) -> None:
    """Raise ValueError where numbers between blanks stand right below a line with fewer names."""
    layout = _lay_out(lines, start, BLANKS)
    if layout is None or layout.columns < 2 or layout.first == start:
        return
    above = without_mark(lines[layout.first - 1])
    if len(above.split()) > 1 and not any(separator in above for separator in SEPARATORS):
        raise ValueError(
            f'the line above the numbers, "{shown(above)}", does not name each of their {layout.columns} columns: '
            "write a name for each, with two blanks or more between them"
        )


def _form_by(lines: Sequence[str], start: int, separator: str, borders: Sequence[int]) -> Form | None:
    """Return the form with this separator; None: the lines do not agree with it."""
    layout = _lay_out(lines, start, separator)
    if layout is None:
        return None
    rows, columns, first, _ = layout
    top = first
    while top > start and not layout.has_numbers(rows[top - 1]) and _fits(rows[top - 1], layout):
        if top in borders and top < first:
            break
        top -= 1
    if top == first - 1 > start and len(rows[top - 1]) == columns and layout.has_units(rows[top]):
        top -= 1  # names that are numbers, above their units
    head, block = first, rows[top:first]
    block = [row for row in _without_comments(block, lines[top:first]) if not _is_drawn(row)]
    block = without_levels(block, _are_units) if block else block
    named = _names_and_units(block, layout) if block else names_above(lines[:first], separator, columns)
    nameless = [f"{NAMELESS}{k}" for k in range(1, columns + 1)]
    if named is not None and not named.names:
        named = named._replace(names=nameless)
    elif named is None and first == start and _are_readings(rows[first], layout):
        named = Named(nameless, [])
    elif named is None:
        if first > start or all(is_number(cell) for cell in rows[first] if cell) or len(rows) < first + 2:
            return None
        head, named = first + 1, Named(rows[first], [])  # numbers among the names of the columns
    surplus = next((one for one in named.names[columns:] if one and not _COMMENT.fullmatch(one)), "")
    names = [*named.names[:columns], *[""] * (columns - len(named.names))]
    if not names[0] and any(names) and len(rows) > head and rows[head][0]:
        names[0] = nameless[0]  # an index that pandas or R wrote
    units = tuple(bare_unit(cell) for cell in named.units)
    decimal = "," if _has_decimal_comma(rows[head:], separator) else "."
    return Form(tuple(names), units, head, separator, decimal, surplus)


def _lay_out(lines: Sequence[str], start: int, separator: str) -> _Layout | None:
    """Return the lines as cells; None: they do not hold numbers in columns of this separator."""
    rows = [cells_of(line, separator) for line in lines]
    usual = Counter(len(row) for row in rows[start + (len(rows) - start) // 2 :]).most_common(1)
    columns = usual[0][0] if usual else 0
    shown = [row for row in rows[start + (len(rows) - start) // 2 :] if len(row) == columns]
    numeric = [k for k in range(columns) if _is_numeric([row[k] for row in shown])]
    if not numeric:
        return None
    for k in range(start, len(rows)):
        if not any(is_number(cell) for cell in rows[k]):
            drawn = [lines[k]] * columns if _DRAWN.fullmatch("".join(lines[k].split())) else None
            rows[k] = (
                drawn or _as_names(lines[k], separator, columns) or _whole(lines[k], separator) or rows[k]
            )
    for k in range(_below_keys(rows, start, columns, numeric), len(rows)):
        row = rows[k]
        held = sum(is_number(row[one]) or not row[one] for one in numeric) if len(row) == columns else 0
        layout = _Layout(rows, columns, k, numeric)
        above_units = k + 1 < len(rows) and len(rows[k + 1]) == columns and layout.has_units(rows[k + 1])
        if 2 * held > len(numeric) and layout.has_numbers(row) and not above_units:
            while k > start and len(rows[k - 1]) == columns and layout.has_numbers(rows[k - 1]):
                if layout.has_units(rows[k]):
                    break
                k -= 1  # numbers among text: wrong cells, which are told with their row
            return layout._replace(first=k)
    return None


def _as_names(line: str, separator: str, columns: int) -> list[str] | None:
    """Return a line above the numbers as names, without the mark of a comment; None: it has none, or not so many."""
    if separator == BLANKS:
        return spaced_names(line, columns)
    text = without_mark(line)
    cells = cells_of(text, separator) if not line.startswith(separator) else []
    if len(cells) > columns:
        cells = joined_brackets(cells, separator, text)
    return cells if len(cells) == columns else None


def _whole(line: str, separator: str) -> list[str]:
    """Return a line of names with units apart from them, which are not as many as the columns, as one cell; [] else."""
    cells = cells_of(line, separator)
    units = sum(cell[:1] in ("[", "(") for cell in cells)
    return [line] if separator == BLANKS and 0 < units < len(cells) else []


def _below_keys(rows: list[list[str]], start: int, columns: int, numeric: list[int]) -> int:
    """Return the line from which numbers are sought: below rows of a key and numbers, if names stand below these."""
    found = start
    for k in range(start, len(rows)):
        row = rows[k]
        if len(row) != columns:
            continue
        if is_number(row[numeric[0]]):
            break
        if found <= k and all(row) and not any(is_number(row[one]) for one in numeric):
            found = k
    return found


def _are_readings(row: list[str], layout: _Layout) -> bool:
    """Return whether a row has readings, and no names: numbers throughout, or decimals beside notes."""
    if all(is_number(cell) for cell in row):
        return True
    cells = [row[k] for k in layout.numeric if k < len(row)]
    return all(is_number(cell) for cell in cells) and any(not cell.isdigit() for cell in cells)


def _fits(row: list[str], layout: _Layout) -> bool:
    """Return whether a row has as many cells as the rows of numbers, whose last cells may all be empty or absent."""
    if len(row) == layout.columns + 1:
        return all(len(one) == layout.columns for one in layout.rows[layout.first :])
    if len(row) == layout.columns - 1:
        return all(not one[-1] for one in layout.rows[layout.first :] if len(one) == layout.columns)
    return len(row) == layout.columns


def _is_numeric(cells: list[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return bool(filled) and 10 * sum(is_number(cell) for cell in filled) >= 9 * len(filled)


def _names_and_units(block: list[list[str]], layout: _Layout) -> Named:
    """Return the names and the units of the last lines above the numbers, mostly in this order; no units: none."""
    while len(block) > 1:
        if not _names_nothing(block[-1]) and not (_says_one(block[-1]) and _has_units(block[-2])):
            break
        block = block[:-1]
    if len(block) < 2:
        return Named(block[-1], [])
    above, below = block[-2], block[-1]
    if all(readable(bare_unit(cell)) for cell in above) and _common_units(above) > _common_units(below):
        return Named(below, above)
    if _are_units(below) or layout.has_units(below) or _says_one(below):
        return Named(above, below)
    return Named(below, [])


def _without_comments(block: list[list[str]], lines: Sequence[str]) -> list[list[str]]:
    """Return the lines above the numbers without comments below names that have units, or below these."""
    count = len(block)
    while (
        count > 1
        and lines[count - 1].startswith(COMMENTS)
        and not lines[count - 2].startswith(COMMENTS)
        and _has_units(block[count - 2])
        and not _has_units(block[count - 1])
    ):
        count -= 1
    return block[:count]


def _names_nothing(row: list[str]) -> bool:
    """Return whether a row below the names says something else of its columns: rates, types, `key=value`, lines."""
    filled = [cell for cell in row if cell]
    are_types = bool(filled) and all(cell.lower() in _TYPES for cell in filled)
    return is_rate_row(row) or are_types or (bool(filled) and all("=" in cell for cell in filled))


def _is_drawn(row: list[str]) -> bool:
    filled = ["".join(cell.split()) for cell in row if cell]
    return bool(filled) and all(_DRAWN.fullmatch(cell) for cell in filled)


def _says_one(row: list[str]) -> bool:
    """Return whether a row says one thing of all columns, and no unit: `run1`, `digits`."""
    filled = [cell for cell in row if cell]
    return len(filled) > 1 and len(set(filled)) == 1 and not readable(bare_unit(filled[0]))


def _has_units(row: list[str]) -> bool:
    filled = [cell for cell in row if cell]
    return 2 * _common_units(filled) >= len(filled) or any(unit_in_name(cell) for cell in filled)


def is_rate_row(row: Sequence[str]) -> bool:
    """Return whether all cells of a row that are filled are sample rates with their unit."""
    filled = [cell for cell in row if cell]
    return bool(filled) and all(_RATE.fullmatch(cell) for cell in filled)


def _common_units(row: list[str]) -> int:
    """Return how many cells are units that people use: those that a letter names by chance (a: a year) are not."""
    return sum(is_common(bare_unit(cell)) for cell in row if cell)


def _are_units(row: list[str]) -> bool:
    """Return whether at least half of the cells that are filled are units."""
    filled = [bare_unit(cell) for cell in row if cell]
    units = sum(is_no_unit(one) or readable(one) or stated_amplitude(one) is not None for one in filled)
    return bool(filled) and 2 * units >= len(filled)


def _has_decimal_comma(rows: list[list[str]], separator: str) -> bool:
    """Return whether numbers have a decimal comma; between commas they stand in quotes, and might be thousands."""
    commas = [cell for row in rows for cell in row if _DECIMAL_COMMA.fullmatch(cell)]
    return any(not _THOUSANDS.fullmatch(cell) for cell in commas) if separator == "," else bool(commas)


def _plain_form(lines: Sequence[str], start: int, separators: Sequence[str]) -> Form:
    """Return the form of a file whose first line names the columns, whatever follows. Raises ValueError in words."""
    header = lines[start]
    separator = max((",", *separators) if len(separators) > 1 else separators, key=header.count)
    names = cells_of(header, separator)
    if all(is_number(name) for name in names):
        raise ValueError(
            f'the first line must name the columns, got numbers: "{header[:60]}"; add a line with a name a column'
        )
    return Form(tuple(names), (), start + 1, separator, ".")
