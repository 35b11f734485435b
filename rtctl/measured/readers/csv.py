"""Text files with columns (CSV and its relatives): separators, decimal marks, heads and encodings as they come."""

from __future__ import annotations

import csv
import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.csv

from rtctl.measured.readers.delimited.ending import find_ending
from rtctl.measured.readers.delimited.form import NAMELESS, Form, is_rate_row
from rtctl.measured.readers.delimited.labview import starts_of
from rtctl.measured.readers.delimited.names import BLANKS, cells_of, is_number
from rtctl.measured.readers.delimited.opening import OPENING_LINES, REMEDY, find_opening
from rtctl.measured.readers.delimited.text import BLOCK_BYTES, Lines, Text, index_lines, open_text, too_long
from rtctl.measured.readers.delimited.thousands import check_thousands, may_have_thousands
from rtctl.measured.readers.delimited.words import COMMENTS, of_words, shown
from rtctl.measured.readers.stated.beside import level_of_lines
from rtctl.measured.readers.stated.preamble import NumberedLine, quoted, read_preamble
from rtctl.measured.readers.table import Column, Header, Table, arrow_numbers, arrow_parts, arrow_slice

TOGETHER_BYTES = 64 << 20
"""Bytes of the numbers that one pass over a file keeps; a larger file takes several passes."""


def read(path: Path) -> Table:
    """Return the columns; lines before the header that start with # are skipped. Raises ValueError in words."""
    text = open_text(path)
    opening, form = find_opening(text)
    notes = _notes(opening, form)
    preamble = read_preamble([*_above(opening, form), *notes], form.decimal)
    if form.separator == BLANKS:
        text, form = text.with_tabs(), form._replace(separator="\t")
    lines = index_lines(text, form.head)
    if lines.only_blanks and form.separator != "\t":
        text = text.without_blank_lines()
        lines = index_lines(text, form.head)
    elif lines.only_blanks:  # a line of tabs is a row of empty cells, above the numbers too
        form = form._replace(head=text.lines_until(form.head))
        lines = index_lines(text, form.head)
    above = [one.text for one in opening[: form.head]]
    ending = find_ending(text, form, max(lines.written - form.head, 0), above)
    rows = max(lines.written - form.head - ending.rows, 0)
    end_byte = text.size() - ending.cut_bytes
    columns = {name: k for k, name in enumerate(form.names) if name}

    source = _Source(text, form, lines, end_byte, columns)

    def load(name: str, first: int, end: int) -> Column:
        return _numbers_or_text(source, name, first, end)

    def load_together(names: Sequence[str]) -> dict[str, Column]:
        numbered = {name: columns[name] for name in names}
        if not rows:
            return {}
        found = _numbers_together(text, form, numbered, rows, (lines.places[0].byte, end_byte))
        return {name: cells for name, cells in found.items() if not may_have_thousands(cells)}

    unclear = _unclear(text, form, rows, (lines.places[0].byte, end_byte)) if rows else set()
    starts = starts_of(above, form.names)
    remarks = tuple(one for one in (ending.remark, preamble.doubt, starts.remark) if one)
    return Table(
        columns=_headers(form, rows, starts.start_s, unclear),
        load=load,
        load_together=load_together,
        remarks=remarks,
        preamble=preamble,
        texts=_texts(opening, form),
        beside={"": level_of_lines(one.text for one in (*_unnamed(opening, form), *notes))},
    )


class _Source(NamedTuple):
    """The numbers of a file."""

    text: Text
    form: Form
    lines: Lines
    end_byte: int
    columns: Mapping[str, int]
    """Places of the columns."""

    def cells(self, name: str, first: int, end: int, kind: pa.DataType, decimal: str) -> Column:
        """Return rows of a column. Raises pa.ArrowInvalid where they are not of this kind."""
        places = self.lines.places
        place = places[bisect_right(places, first + self.form.head, key=lambda line: line.number) - 1]
        skipped, part = first + self.form.head - place.number, (place.byte, self.end_byte)
        blocks = _blocks(self.text, self.form._replace(decimal=decimal), [self.columns[name]], kind, part)
        return arrow_slice((block.column(0) for block in blocks), skipped, end - first + skipped)


def _numbers_or_text(source: _Source, name: str, first: int, end: int) -> Column:
    """Return rows of a column. Raises ValueError in words."""
    if first >= end:
        return np.empty(0)
    form = source.form
    attempts = [(pa.float64(), form.decimal)]
    if form.decimal == "." and form.separator != ",":
        attempts.append((pa.float64(), ","))  # the opening lines may hold whole numbers only
    attempts.append((pa.string(), form.decimal))  # text: the message about it can tell the rows
    for kind, decimal in attempts:
        try:
            cells = source.cells(name, first, end, kind, decimal)
        except pa.ArrowInvalid as error:
            if "conversion error" not in str(error):
                raise ValueError(_about_cells(str(error), form, source.text)) from None
            continue
        if kind == pa.string():
            return of_words(cells, form.names, first)
        if may_have_thousands(cells):
            check_thousands(source.cells(name, first, end, pa.string(), decimal), name, first, decimal)
        return cells
    raise ValueError(f'column "{name}" is neither numbers nor text in UTF-8')


def _above(opening: Sequence[NumberedLine], form: Form) -> list[NumberedLine]:
    """Return the lines above the numbers, and numbers below names as lines: `Increment` above 1e-3."""
    lines = opening[: form.head]
    below = [(name, cell) for name, cell in zip(form.names, form.units, strict=False) if is_number(cell)]
    cells = [cells_of(one.text, form.separator) for one in lines]
    lines = [
        one._replace(text="\t".join(["Sample rate:", *row])) if is_rate_row(row) else one
        for one, row in zip(lines, cells, strict=True)
    ]
    return [*lines, *(lines[-1]._replace(text=f"{name} = {cell}") for name, cell in below)]


def _notes(opening: Sequence[NumberedLine], form: Form) -> list[NumberedLine]:
    """Return notes beside the first rows of nameless numbers, key and value in columns of their own, as lines."""
    if form.names[:2] != (f"{NAMELESS}1", f"{NAMELESS}2"):
        return []
    rows = [(line, cells_of(line.text, form.separator)) for line in opening[form.head :]]
    return [
        line._replace(text=",".join(cells[:2]))
        for line, cells in rows
        if len(cells) == len(form.names) > 2 and cells[0] and not is_number(cells[0])
    ]


def _texts(opening: Sequence[NumberedLine], form: Form) -> dict[str, str]:
    """Return the lines above the columns; the line that names them is none."""
    return {quoted(one): one.text for one in _unnamed(opening, form)}


def _unnamed(opening: Sequence[NumberedLine], form: Form) -> list[NumberedLine]:
    """Return the lines above the columns, without the one that names them."""
    names = [re.compile(rf"(?<!\w){re.escape(name)}(?!\w)") for name in form.names if name]
    return [one for one in opening[: form.head] if not all(name.search(one.text) for name in names)]


def _about_cells(error: str, form: Form, text: Text) -> str:
    """Return what a person reads where a row is too long, or has not as many cells as there are columns."""
    if "straddling" in error and (number := text.too_long_line()):
        return too_long(number)
    found = re.search(r"Expected (\d+) columns, got (\d+)", error)
    if found is None:
        return f"not readable as CSV: {error}"
    expected, cells = int(found[1]), int(found[2])
    number, line = _line_of_cells(text, form, cells)
    where = f"line {number}" if number else "a row"
    told = f"not readable as CSV: {where} has {cells} cells, the file has {expected} columns"
    if line.lstrip().startswith(COMMENTS):
        told += (
            f': "{shown(line)}" is a comment among the numbers: remove it; where the measurement was interrupted '
            "there, divide the file"
        )
    elif line:
        told += f': correct or remove that line, "{shown(line)}"; where another table begins there, divide the file'
    if number > OPENING_LINES[-1]:
        told += f" by its first {OPENING_LINES[-1]} lines; if they begin below these, {REMEDY}"
    if form.separator == "," and expected < cells <= 2 * expected:
        told += (
            ". Perhaps commas stand both between the columns and in the numbers (a decimal comma): export the file "
            "with semicolons or tabs between the columns, or with decimal points"
        )
    return told


def _line_of_cells(text: Text, form: Form, cells: int) -> tuple[int, str]:
    """Return the number, from 1, of the first line of numbers with so many cells, and the line; 0: it is not found."""
    written = 0
    with text.opened() as file:
        for number, line in enumerate(file, 1):
            if not line.strip(b"\r\n"):
                continue
            written += 1
            try:
                parts = next(iter(csv.reader([line.decode("latin-1")], delimiter=form.separator)), [])
            except csv.Error:  # a line without end, or of another kind
                return 0, ""
            if written > form.head and len(parts) == cells:
                return number, line.decode("latin-1").rstrip("\r\n")
    return 0, ""


def _unclear(text: Text, form: Form, rows: int, part: tuple[int, int]) -> set[str]:
    """Return the names that several columns have, unless these are the same time, beside each signal."""
    found = set[str]()
    for name in {name for name, count in Counter(form.names).items() if name and count > 1}:
        places = {str(k): k for k, one in enumerate(form.names) if one == name}
        if len({form.units[k] for k in places.values() if k < len(form.units)}) > 1:
            found.add(name)
            continue
        copies = list(_numbers_together(text, form, places, rows, part).values())
        increases = bool(copies) and bool(np.all(np.diff(copies[0]) > 0.0))
        if not increases or len(copies) < len(places) or any(np.any(copies[0] != one) for one in copies):
            found.add(name)
    return found


def _headers(
    form: Form, rows: int, starts: Mapping[str, float], unclear: Collection[str]
) -> dict[str, Header]:
    units = dict(zip(form.names, form.units, strict=False))
    return {
        name: Header(
            shape=(rows,),
            unit=units.get(name) or None,
            start_s=starts.get(name),
            start_key="X0" if name in starts else "",
            refusal="is not clear, as two columns have the same name; rename one" if name in unclear else "",
        )
        for name in form.names
        if name
    }


def _numbers_together(
    text: Text, form: Form, columns: Mapping[str, int], rows: int, part: tuple[int, int]
) -> dict[str, Column]:
    """Return those of the columns (by name, with their places) that are numbers. Raises ValueError for wrong lines."""
    several = max(TOGETHER_BYTES // (8 * rows), 1)
    names = list(columns)
    found: dict[str, Column] = {}
    for k in range(0, len(names), several):
        left = {name: columns[name] for name in names[k : k + several]}
        while left:
            try:
                found |= _in_one_pass(text, form, left, rows, part)
                break
            except pa.ArrowInvalid as error:
                if "conversion error" not in str(error):
                    raise ValueError(_about_cells(str(error), form, text)) from None
                wrong = re.search(r"CSV column #(\d+):", str(error))  # no numbers, or numbers of another form
                left = {name: place for name, place in left.items() if wrong and place != int(wrong[1])}
    return found


def _in_one_pass(
    text: Text, form: Form, columns: Mapping[str, int], rows: int, part: tuple[int, int]
) -> dict[str, Column]:
    """Return columns of numbers, all of them read at once. Raises pa.ArrowInvalid where one is none."""
    pieces: list[list[Column]] = [[] for _ in columns]
    for block in arrow_parts(_blocks(text, form, list(columns.values()), pa.float64(), part), 0, rows):
        for held, column in zip(pieces, block.columns, strict=True):
            held.append(arrow_numbers(column))
    return {name: np.concatenate(held) for name, held in zip(columns, pieces, strict=True)}


def _blocks(
    text: Text, form: Form, columns: Sequence[int], kind: pa.DataType, part: tuple[int, int]
) -> Iterator[pa.RecordBatch]:
    """Yield columns of a part (bytes) of the lines, in blocks; columns go by place, as names may repeat."""
    places = [str(k) for k in range(len(form.names))]
    with (
        text.source() as source,
        pa.csv.open_csv(
            source.get_stream(part[0], part[1] - part[0]),
            read_options=pa.csv.ReadOptions(column_names=places, block_size=BLOCK_BYTES),
            parse_options=pa.csv.ParseOptions(delimiter=form.separator),
            convert_options=pa.csv.ConvertOptions(
                decimal_point=form.decimal,
                include_columns=[str(column) for column in columns],
                column_types={str(column): kind for column in columns},
                strings_can_be_null=True,
            ),
        ) as blocks,
    ):
        yield from blocks
