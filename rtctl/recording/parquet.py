"""Recordings as Parquet: units in the fields' metadata, what was run in the schema's; whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.output.atomic_write import replacing

ROWS_OF_A_GROUP = 1 << 20


def write_parquet(
    path: Path, table: Mapping[str, FloatArray], units: Mapping[str, str], metadata: Mapping[str, str]
) -> None:
    """Write columns as Parquet, whole or not at all; the same bytes for the same content.

    Args:
        path: the file.
        table: columns (n,) by name.
        units: unit of each column, for the field's metadata.
        metadata: for the schema.
    """
    write_parquet_parts(path, list(table), [table], units, metadata)


def write_parquet_parts(
    path: Path,
    names: list[str],
    parts: Iterable[Mapping[str, FloatArray]],
    units: Mapping[str, str],
    metadata: Mapping[str, str],
) -> None:
    """Write a table that comes in parts and need not fit into memory; see `write_parquet`.

    Args:
        path: the file.
        names: names of the columns.
        parts: columns (n,) by name, part by part; a part is one row group or more.
        units: unit of each column, for the field's metadata.
        metadata: for the schema.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, pa.float64(), metadata={"unit": units.get(name, "")}) for name in names]
    schema = pa.schema(fields, metadata={key: str(value) for key, value in metadata.items()})
    with replacing(path) as partial, pq.ParquetWriter(partial, schema, compression="zstd") as writer:
        for part in parts:
            arrays = [pa.array(np.asarray(part[name], dtype=np.float64)) for name in names]
            writer.write_table(pa.table(arrays, schema=schema), row_group_size=ROWS_OF_A_GROUP)
