"""Parquet: reads only the requested row groups and column; a field's metadata may state its unit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.measured.readers.table import (
    Column,
    Table,
    arrow_beside,
    arrow_fields,
    arrow_headers,
    arrow_part,
    arrow_readings,
    arrow_slice,
    arrow_texts,
    reading,
)

_BATCH_ROWS = 65_536
_BUFFER_BYTES = 1 << 20


def read(path: Path) -> Table:
    """Return the columns of a Parquet file. Raises ValueError in words."""
    with reading("a Parquet file"), pq.ParquetFile(path) as file:
        headers = arrow_headers(file.schema_arrow, file.metadata.num_rows)
        texts, beside = arrow_texts(file.schema_arrow), arrow_beside(file.schema_arrow)

    def load(name: str, first: int, end: int) -> Column:
        with (
            reading("a Parquet file"),
            pq.ParquetFile(path, buffer_size=_BUFFER_BYTES, pre_buffer=False) as file,
        ):
            groups, start = _groups(file.metadata, first, end)
            path_in_row = arrow_fields(file.schema_arrow)[name].path
            stored = arrow_slice(
                arrow_part(_pieces(file, name, groups), path_in_row), first - start, end - start
            )
            return arrow_readings(file.schema_arrow, name, stored)

    return Table(columns=headers, load=load, texts=texts, beside=beside)


def _groups(metadata: pq.FileMetaData, first: int, end: int) -> tuple[list[int], int]:
    """Return the row groups that hold rows [first, end), and the row at which they start."""
    sizes = [metadata.row_group(k).num_rows for k in range(metadata.num_row_groups)]
    starts = np.cumsum([0, *sizes])
    groups = [k for k in range(len(sizes)) if starts[k] < end and starts[k + 1] > first]
    return groups, int(starts[groups[0]]) if groups else first


def _pieces(file: pq.ParquetFile, name: str, groups: list[int]) -> Iterator[pa.Array]:
    batches = file.iter_batches(batch_size=_BATCH_ROWS, row_groups=groups, columns=[name], use_threads=False)
    return (batch.column(0) for batch in batches)
