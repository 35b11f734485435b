"""Parquet: columns are read one at a time; a field's metadata may state its unit."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.measured.readers.table import Table, arrow_table


def read(path: Path) -> Table:
    """Columns of a Parquet file. Raises ValueError in words."""
    try:
        schema = pq.read_schema(path)
    except pa.ArrowInvalid as error:
        raise ValueError(f"not a Parquet file: {error}") from None
    return arrow_table({name: partial(_column, path, name) for name in schema.names}, schema)


def _column(path: Path, name: str) -> pa.ChunkedArray:
    return pq.read_table(path, columns=[name]).column(0)
