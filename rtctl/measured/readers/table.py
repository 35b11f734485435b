"""What every reader gives: names of columns, and each column as an array when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

Column = NDArray[Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Columns of one file. `load` may raise ValueError in words."""

    columns: tuple[str, ...]
    load: Callable[[str], Column]
    units: Mapping[str, str] = field(default_factory=dict)
    """Units that the file itself states (Parquet and Arrow field metadata), for a cross-check."""


def arrow_table(columns: Mapping[str, Callable[[], pa.ChunkedArray]], schema: pa.Schema) -> Table:
    """A `Table` of Arrow columns."""
    units = {
        entry.name: entry.metadata[b"unit"].decode()
        for entry in schema
        if entry.metadata and entry.metadata.get(b"unit")
    }
    return Table(columns=tuple(columns), load=lambda name: arrow_numbers(columns[name]()), units=units)


def arrow_numbers(column: pa.ChunkedArray) -> Column:
    """Numbers as float64 with NaN for nulls; anything else as it is, for the message about it."""
    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        values: Column = column.cast(pa.float64(), safe=False).to_numpy()
        return values
    return np.asarray(column.to_numpy())
