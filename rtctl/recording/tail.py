"""The newest rows of a recording that another thread or process is writing, read without mapping the file.

A mapped file that the writer truncates at its end would kill the reader; a read beyond the end is short instead.
"""

from __future__ import annotations

import os
import weakref
from pathlib import Path

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.recording.layout import read_header, stride_of

MOST_ROWS = 4096
"""Rows that one look reads at most: the newest ones."""


class Tail:
    """Reads the rows that were added since the last look."""

    def __init__(self, path: Path) -> None:
        """Open a recording. Raises InputError if the file is none, OSError if there is no such file."""
        self.header = header = read_header(path)
        self.names = [name for name, _ in header.columns]
        self._path = path
        self._begin, self._stride = header.begin, stride_of(len(self.names))
        self._file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self._closing = weakref.finalize(self, os.close, self._file)
        self.count = 0
        """Whole rows at the last look."""

    def close(self) -> None:
        """Close the file, which also happens when nothing refers to it any more."""
        self._closing()

    def new_rows(self) -> dict[str, FloatArray]:
        """Return the columns (rows,) of the rows since the last look, of very many the newest."""
        before = self.count
        return self.read(max(before, self.look() - MOST_ROWS), self.count)

    def look(self) -> int:
        """Return how many rows are whole by now."""
        self.count = self._whole_rows()
        return self.count

    def read(self, first: int, last: int) -> dict[str, FloatArray]:
        """Return the columns (rows,) of the whole rows from `first` on, counted from 0, before `last`."""
        data = os.pread(self._file, (last - first) * self._stride, self._begin + first * self._stride)
        rows = np.frombuffer(data, dtype="<f8", count=len(data) // self._stride * (self._stride // 8))
        table = rows.reshape(-1, self._stride // 8)
        return {name: table[:, k] for k, name in enumerate(self.names)}

    def replaced(self) -> bool:
        """Return whether another file, or none, has taken the place of this one."""
        try:
            return os.stat(self._path).st_ino != os.fstat(self._file).st_ino
        except OSError:
            return True

    def _whole_rows(self) -> int:
        """Return how many rows are whole: their numbers are written in order, so by bisection from the last count."""
        low, step = self.count, 1
        while self._number(low + step - 1) == low + step:
            low, step = low + step, 2 * step
        high = low + step
        while low < high:
            middle = (low + high) // 2
            if self._number(middle) == middle + 1:
                low = middle + 1
            else:
                high = middle
        return low

    def _number(self, row: int) -> int:
        """Return the number of a row, 0 where it was not written."""
        data = os.pread(self._file, 8, self._begin + (row + 1) * self._stride - 8)
        return int.from_bytes(data, "little") if len(data) == 8 else 0
