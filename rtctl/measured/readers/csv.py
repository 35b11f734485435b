"""CSV with a header line; comma, semicolon or tab between columns; decimal point, or comma if it is free."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pyarrow as pa
import pyarrow.csv

from rtctl.measured.readers.table import Table, arrow_table

_DECIMAL_COMMA = re.compile(r"(^|[;\t])\s*[+-]?\d+,\d")


def read(path: Path) -> Table:
    """Columns; lines in front of the header that begin with # are skipped. Raises ValueError in words."""
    header, first, skipped = _opening_lines(path)
    delimiter = max(",;\t", key=header.count)
    _check_header(header, delimiter)
    decimal = "," if delimiter != "," and _DECIMAL_COMMA.search(first) else "."
    try:
        table = pa.csv.read_csv(
            path,
            read_options=pa.csv.ReadOptions(skip_rows=skipped),
            parse_options=pa.csv.ParseOptions(delimiter=delimiter),
            convert_options=pa.csv.ConvertOptions(decimal_point=decimal),
        )
    except pa.ArrowInvalid as error:
        raise ValueError(f"not readable as CSV: {error}") from None
    columns = {name.strip(): partial(table.column, k) for k, name in enumerate(table.column_names)}
    if len(columns) < len(table.column_names):
        raise ValueError(f"two columns have the same name; columns: {', '.join(table.column_names)}")
    return arrow_table(columns, table.schema)


def _opening_lines(path: Path) -> tuple[str, str, int]:
    """Header, the line after it, and how many comment lines come before."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        skipped = 0
        header = file.readline()
        while header.startswith("#"):
            skipped += 1
            header = file.readline()
        return header.rstrip("\r\n"), file.readline().rstrip("\r\n"), skipped


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
