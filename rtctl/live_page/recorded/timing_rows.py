"""The times of a run's samples (`timing.rec`, by and by `timing.parquet`), row by row beside those of its signals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rtctl.border.arrays import FloatArray
from rtctl.live_page.recorded.rows import GrowingRows, ParquetRows
from rtctl.session.run_folder import TIMING

PARQUET = "timing.parquet"


class TimingRows:
    """The rows of the run in one folder, wherever they lie; used by one thread."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._rows: GrowingRows | ParquetRows | None = None

    def count(self) -> int:
        """Return how many rows there are by now. Raises InputError before the first, OSError where there is no file."""
        return self._opened().count()

    def read(self, first: int, last: int) -> Mapping[str, FloatArray]:
        """Return the columns (rows,) [us] of the rows from `first` on, before `last`. Raises as `count`."""
        return self._opened().read(first, last)

    def close(self) -> None:
        """Close the file."""
        if self._rows is not None:
            self._rows.close()
            self._rows = None

    def _opened(self) -> GrowingRows | ParquetRows:
        if self._rows is None or self._rows.replaced():
            growing = self._folder / TIMING
            opened = GrowingRows(growing) if growing.is_file() else ParquetRows(self._folder / PARQUET)
            self.close()
            self._rows = opened
        return self._rows
