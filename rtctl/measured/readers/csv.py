"""CSV with a header line; comma, semicolon or tab between columns; decimal point, or comma if it is free."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.csv

from rtctl.measured.readers.table import Column, Header, Table, arrow_slice, check_distinct

_DECIMAL_COMMA = re.compile(r"(^|[;\t])\s*[+-]?\d+,\d")
_BLOCK_BYTES = 1 << 18
_LF, _CR, _QUOTE = b'\n\r"'


class _Form(NamedTuple):
    """Format of the lines of a file."""

    names: list[str]
    """Column names as the file writes them, with blanks around."""
    comments: int
    """Number of lines before the header."""
    delimiter: str
    decimal: str


class Line(NamedTuple):
    """Where a line starts; blank lines do not count."""

    number: int
    byte: int


def read(path: Path) -> Table:
    """Return the columns; lines before the header that start with # are skipped. Raises ValueError in words."""
    form = _form(path)
    written = {name.strip(): name for name in form.names}
    head = form.comments + 1
    lines, places = line_index(path, head)
    rows = max(lines - head, 0)

    def load(name: str, first: int, end: int) -> Column:
        place = places[bisect_right(places, first + head, key=lambda line: line.number) - 1]
        skipped = first + head - place.number
        try:
            pieces = _pieces(path, form, written[name], pa.float64(), place.byte)
            return arrow_slice(pieces, skipped, end - first + skipped)
        except pa.ArrowInvalid as error:
            if "conversion error" not in str(error):
                raise ValueError(f"not readable as CSV: {error}") from None
        # text among the numbers: read again as text, so that the message can tell the rows
        pieces = _pieces(path, form, written[name], pa.string(), place.byte)
        return arrow_slice(pieces, skipped, end - first + skipped)

    return Table(columns={name: Header(shape=(rows,)) for name in written}, load=load)


def line_index(path: Path, head: int = 0) -> tuple[int, list[Line]]:
    """Return the number of non-blank lines, and in each block of the file the first of them from line `head` on.

    Lines end with LF, CR LF or CR; the last may lack its end. Raises ValueError for a line break inside quotes.
    """
    count, offset, after_end, in_quotes = 0, 0, True, False
    index: list[Line] = []
    with path.open("rb") as file:
        while block := file.read(_BLOCK_BYTES):
            codes = np.frombuffer(block, np.uint8)
            ends = (codes == _LF) | (codes == _CR)
            if in_quotes or b'"' in block:
                inside = (np.cumsum(codes == _QUOTE) + in_quotes) % 2 == 1
                if (inside & ends).any():
                    raise ValueError("a line break stands inside quotes, or a quote is not closed; remove it")
                in_quotes = bool(inside[-1])
            starts = np.flatnonzero(~ends & np.concatenate([[after_end], ends[:-1]]))
            if count + len(starts) > head:
                k = max(head - count, 0)
                index.append(Line(count + k, offset + int(starts[k])) if k < len(starts) else index[-1])
            count, offset, after_end = count + len(starts), offset + len(block), bool(ends[-1])
    return count, index


def _pieces(path: Path, form: _Form, name: str, kind: pa.DataType, byte: int) -> Iterator[pa.Array]:
    """Yield the column of the lines from `byte` on, a block at a time."""
    with pa.OSFile(str(path)) as source:
        source.seek(byte)
        with pa.csv.open_csv(
            source,
            read_options=pa.csv.ReadOptions(column_names=form.names, block_size=_BLOCK_BYTES),
            parse_options=pa.csv.ParseOptions(delimiter=form.delimiter),
            convert_options=pa.csv.ConvertOptions(
                decimal_point=form.decimal,
                include_columns=[name],
                column_types={name: kind},
                strings_can_be_null=True,
            ),
        ) as blocks:
            for block in blocks:
                yield block.column(0)


def _form(path: Path) -> _Form:
    """Determine the format from the opening lines. Raises ValueError in words."""
    header, first, comments = _opening_lines(path)
    delimiter = max(",;\t", key=header.count)
    _check_header(header, delimiter)
    decimal = "," if delimiter != "," and _DECIMAL_COMMA.search(first) else "."
    try:
        options = pa.csv.ParseOptions(delimiter=delimiter)
        names = pa.csv.read_csv(pa.py_buffer(f"{header}\n".encode()), parse_options=options).column_names
    except pa.ArrowInvalid as error:
        raise ValueError(f"not readable as CSV: {error}") from None
    check_distinct([name.strip() for name in names])
    return _Form(names, comments, delimiter, decimal)


def _opening_lines(path: Path) -> tuple[str, str, int]:
    """Return the header, the line after it, and the number of comment lines before."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        comments = 0
        header = file.readline()
        while header.startswith("#"):
            comments += 1
            header = file.readline()
        return header.rstrip("\r\n"), file.readline().rstrip("\r\n"), comments


def _check_header(header: str, delimiter: str) -> None:
    names = [name.strip() for name in header.split(delimiter)]
    if not header.strip():
        raise ValueError("the header line is empty; the first line must name the columns")
    if all(_is_number(name) for name in names):
        raise ValueError(
            f'the first line must name the columns, got numbers: "{header[:60]}" '
            "(a header behind # is not read; remove the #)"
        )


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True
