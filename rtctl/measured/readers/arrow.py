"""Arrow IPC, file (Feather version 2) or stream: reads only the requested record batches and column."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from functools import cache
from itertools import accumulate
from pathlib import Path

import pyarrow as pa

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

_FILE_MAGIC = b"ARROW1"


def read(path: Path) -> Table:
    """Return the columns of an Arrow file. Raises ValueError in words."""
    with path.open("rb") as file:
        magic = file.read(len(_FILE_MAGIC))
    if magic.startswith(b"FEA1"):
        raise ValueError(
            "is a Feather file of version 1, which is not read; write it as version 2 or Parquet"
        )
    is_file = magic == _FILE_MAGIC
    with reading("an Arrow file"), pa.memory_map(str(path)) as source:
        if is_file:
            opened = pa.ipc.open_file(source)
            schema, rows = opened.schema, opened.count_rows()
        else:
            stream = pa.ipc.open_stream(source)
            schema, rows = stream.schema, sum(batch.num_rows for batch in stream)
    with reading("an Arrow file"):
        columns = arrow_fields(schema)

    @cache
    def batch_starts() -> list[int]:
        with pa.memory_map(str(path)) as source:
            opened = _opened(source, 0)
            sizes = [opened.get_batch(k).num_rows for k in range(opened.num_record_batches)]
        return list(accumulate(sizes, initial=0))

    def load(name: str, first: int, end: int) -> Column:
        with reading("an Arrow file"), pa.memory_map(str(path)) as source:
            within = columns[name].path
            field = schema.names.index(within[0])
            if not is_file:
                parts = arrow_part(_stream_pieces(source, field), within)
                return arrow_readings(schema, name, arrow_slice(parts, first, end))
            starts = batch_starts()
            begin = bisect_right(starts, first) - 1
            pieces = arrow_part(_file_pieces(source, field, begin), within)
            return arrow_readings(
                schema, name, arrow_slice(pieces, first - starts[begin], end - starts[begin])
            )

    return Table(
        columns=arrow_headers(schema, rows),
        load=load,
        piecewise=is_file,
        texts=arrow_texts(schema),
        beside=arrow_beside(schema),
    )


def _opened(source: pa.NativeFile, field: int) -> pa.RecordBatchFileReader:
    return pa.ipc.open_file(source, options=pa.ipc.IpcReadOptions(included_fields=[field]))


def _file_pieces(source: pa.NativeFile, field: int, begin: int) -> Iterator[pa.Array]:
    opened = _opened(source, field)
    return (opened.get_batch(k).column(0) for k in range(begin, opened.num_record_batches))


def _stream_pieces(source: pa.NativeFile, field: int) -> Iterator[pa.Array]:
    opened = pa.ipc.open_stream(source, options=pa.ipc.IpcReadOptions(included_fields=[field]))
    return (batch.column(0) for batch in opened)
