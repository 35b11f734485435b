"""Recording of a run: a row a step into memory, whole tables to Parquet at the end, units in the schema.

`signals.parquet` holds no machine time, so a lockstep run repeated gives the same bytes; lateness, round trip and
compute time go to `timing.parquet`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Columns = Sequence[tuple[str, str]]
"""Names and units, in the order of a row."""


class Recorder:
    """Collects rows of floats; `append` costs a list append and never blocks. `SignalRecorder` of the loop."""

    def __init__(self, columns: Columns) -> None:
        names = [name for name, _ in columns]
        if len(set(names)) != len(names):
            raise ValueError(f"column names must differ, got {names}")
        self.columns = list(columns)
        self._rows: list[tuple[float, ...]] = []
        self.append = self._rows.append

    def __len__(self) -> int:
        return len(self._rows)

    def table(self) -> dict[str, NDArray[np.float64]]:
        """Columns (rows,) by name."""
        values = np.array(self._rows, dtype=np.float64).reshape(len(self._rows), len(self.columns))
        return {name: np.ascontiguousarray(values[:, k]) for k, (name, _) in enumerate(self.columns)}

    def write(self, path: Path, metadata: Mapping[str, str]) -> None:
        """All rows as Parquet, whole or not at all; `metadata` goes into the schema."""
        write_parquet(path, self.table(), dict(self.columns), metadata)


def write_parquet(
    path: Path, table: Mapping[str, NDArray[np.float64]], units: Mapping[str, str], metadata: Mapping[str, str]
) -> None:
    """Columns with units as field metadata. Written beside `path`, then renamed."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(name, pa.float64(), metadata={"unit": units.get(name, "")}) for name in table]
    schema = pa.schema(fields, metadata={key: str(value) for key, value in metadata.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    pq.write_table(pa.table([pa.array(column) for column in table.values()], schema=schema), part, compression="zstd")
    part.replace(path)
