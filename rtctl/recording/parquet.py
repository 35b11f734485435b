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
    """Columns with units as field metadata, whole or not at all; the same bytes for the same content."""
    write_parquet_parts(path, list(table), [table], units, metadata)


def write_parquet_parts(
    path: Path,
    names: list[str],
    parts: Iterable[Mapping[str, FloatArray]],
    units: Mapping[str, str],
    metadata: Mapping[str, str],
) -> None:
    """The same for a table that comes in parts and need not fit into memory; a part is one row group or more."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, pa.float64(), metadata={"unit": units.get(name, "")}) for name in names]
    schema = pa.schema(fields, metadata={key: str(value) for key, value in metadata.items()})
    with replacing(path) as partial, pq.ParquetWriter(partial, schema, compression="zstd") as writer:
        for part in parts:
            arrays = [pa.array(np.asarray(part[name], dtype=np.float64)) for name in names]
            writer.write_table(pa.table(arrays, schema=schema), row_group_size=ROWS_OF_A_GROUP)
