"""Recordings as Parquet: units in the fields' metadata, what was run in the schema's; whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of

ROWS_OF_A_GROUP = 1 << 20


def write_parquet(
    path: Path,
    table: Mapping[str, FloatArray],
    units: Mapping[str, str],
    metadata: Mapping[str, str],
    command: str,
) -> None:
    """Write columns as Parquet, whole or not at all; the same bytes for the same content.

    Args:
        path: the file.
        table: columns (n,) by name.
        units: unit of each column, for the field's metadata.
        metadata: for the schema.
        command: which command writes it, for the schema too.

    Raises:
        InputError: `command` did not write the file that is there.
    """
    write_parquet_parts(path, list(table), [table], units, metadata, command)


def write_parquet_parts(
    path: Path,
    names: list[str],
    parts: Iterable[Mapping[str, FloatArray]],
    units: Mapping[str, str],
    metadata: Mapping[str, str],
    command: str,
) -> None:
    """Write a table that comes in parts and need not fit into memory; see `write_parquet`.

    Args:
        path: the file.
        names: names of the columns.
        parts: columns (n,) by name, part by part; a part is one row group or more.
        units: unit of each column, for the field's metadata.
        metadata: for the schema.
        command: which command writes it, for the schema too.

    Raises:
        InputError: `command` did not write the file that is there.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, pa.float64(), metadata={"unit": units.get(name, "")}) for name in names]
    texts = {key: str(value) for key, value in metadata.items()} | {"program": mark_of(command)}
    schema = pa.schema(fields, metadata=texts)
    with replacing(path, command) as partial, pq.ParquetWriter(partial, schema, compression="zstd") as writer:
        for part in parts:
            arrays = [pa.array(np.asarray(part[name], dtype=np.float64)) for name in names]
            writer.write_table(pa.table(arrays, schema=schema), row_group_size=ROWS_OF_A_GROUP)
