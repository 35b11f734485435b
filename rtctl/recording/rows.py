"""Rows of numbers in memory: for runs of which no file is wanted before they end."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.recording.parquet import write_parquet

Columns = Sequence[tuple[str, str]]
"""Names and units of the columns, in the order of a row."""

CHUNK_ROWS = 4096


class Recorder:
    """A `SignalRecorder` that collects rows of numbers as float64.

    A row is packed into a chunk that is allocated whole: half a microsecond, every time the same. A list of tuples
    appends in a fifth of that, but takes five times the memory, is walked by the garbage collector and is converted in
    bursts of milliseconds, which would show as jitter.
    """

    def __init__(self, columns: Columns) -> None:
        names = [name for name, _ in columns]
        if len(set(names)) != len(names) or not names:
            raise ValueError(f"column names must differ, got {names}")
        self.columns = list(columns)
        layout = struct.Struct(f"={len(names)}d")
        self._pack, self._stride = layout.pack_into, layout.size
        self._end = CHUNK_ROWS * layout.size
        self._full: list[bytearray] = []
        self._chunk = bytearray(self._end)
        self._offset = 0

    def append(self, row: tuple[float, ...]) -> None:
        """Append one row, in the order of the columns. Raises ValueError on another number of values."""
        if self._offset == self._end:
            self._full.append(self._chunk)
            self._chunk = bytearray(self._end)
            self._offset = 0
        try:
            self._pack(self._chunk, self._offset, *row)
        except struct.error as error:
            raise ValueError(f"a row of {len(row)} values for {len(self.columns)} columns: {error}") from None
        self._offset += self._stride  # last: an interrupted append leaves no half row

    def ahead(self, most: int) -> FloatArray:
        """Return room (rows, columns) for at most so many next rows, written in place; then call `advance`."""
        if self._offset == self._end:
            self._full.append(self._chunk)
            self._chunk = bytearray(self._end)
            self._offset = 0
        rows = min(most, (self._end - self._offset) // self._stride)
        width = len(self.columns)
        room = np.frombuffer(self._chunk, count=rows * width, offset=self._offset)
        return room.reshape(rows, width)

    def advance(self, rows: int) -> None:
        """Take so many rows of `ahead` as written."""
        self._offset += rows * self._stride

    def __len__(self) -> int:
        return len(self._full) * CHUNK_ROWS + self._offset // self._stride

    def table(self) -> dict[str, FloatArray]:
        """Return the columns (rows,) by name."""
        parts = [np.frombuffer(chunk) for chunk in self._full]
        parts.append(np.frombuffer(self._chunk, count=self._offset // 8))
        values = np.concatenate(parts).reshape(len(self), len(self.columns))
        return {name: np.ascontiguousarray(values[:, k]) for k, (name, _) in enumerate(self.columns)}

    def write(self, path: Path, metadata: Mapping[str, str]) -> None:
        """Write all rows so far as Parquet, whole or not at all; `metadata` goes into the schema."""
        write_parquet(path, self.table(), dict(self.columns), metadata, "run")
