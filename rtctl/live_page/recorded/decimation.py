"""Smallest and largest values of many rows in few bins, in memory that does not grow with the recording.

Blocks of rows are summarised once, as they come; when there are more than `MOST_BLOCKS`, neighbours are merged and a
block is twice as long. A range of many blocks is drawn from them, a short one from its rows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray

MOST_BLOCKS = 32768
FIRST_BLOCK_ROWS = 64
ROWS_OF_A_READ = 1 << 16
"""Rows that are in memory at once while they are summarised."""

Read = Callable[[int, int], FloatArray]
"""`read(first, last)`: the columns (columns, last - first) of rows."""


class Extremes(NamedTuple):
    """Smallest and largest values of each column in bins of rows."""

    first: IntArray
    """First row of each bin (bins,)."""
    low: FloatArray
    """Smallest values (columns, bins); NaN where a bin has no number."""
    high: FloatArray
    """Largest values (columns, bins)."""
    last: int
    """The row behind the last bin."""


def extremes(values: FloatArray, begins: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and largest numbers of each bin.

    Args:
        values: columns (columns, rows).
        begins: place in `values` where each bin begins (bins,), ascending without repeats.

    Returns:
        Two arrays (columns, bins); NaN where a bin has no number.
    """
    return np.fmin.reduceat(values, begins, axis=1), np.fmax.reduceat(values, begins, axis=1)


def bin_begins(first: int, last: int, bins: int) -> IntArray:
    """Return the first row of each of at most `bins` bins of nearly equal length, from `first` to before `last`."""
    count = max(min(bins, last - first), 0)
    return first + np.arange(count, dtype=np.int64) * (last - first) // max(count, 1)


class Pyramid:
    """Blocks of rows with their extremes; `range` draws any range in any number of bins."""

    def __init__(self, columns: int) -> None:
        self.block_rows = FIRST_BLOCK_ROWS
        """Rows of a block."""
        self._blocks = 0
        self._low = np.full((columns, MOST_BLOCKS), np.nan)
        self._high = np.full((columns, MOST_BLOCKS), np.nan)

    @property
    def rows(self) -> int:
        """Rows that are summarised."""
        return self._blocks * self.block_rows

    def extend(self, count: int, read: Read) -> None:
        """Summarise the whole blocks of a recording of by now `count` rows."""
        while count - self.rows >= self.block_rows:
            if self._blocks == MOST_BLOCKS:
                self._merge()
                continue
            room = min((count - self.rows) // self.block_rows, MOST_BLOCKS - self._blocks)
            blocks = min(room, max(ROWS_OF_A_READ // self.block_rows, 1))
            values = read(self.rows, self.rows + blocks * self.block_rows)
            begins = self.block_rows * np.arange(blocks, dtype=np.int64)
            found = slice(self._blocks, self._blocks + blocks)
            self._low[:, found], self._high[:, found] = extremes(values, begins)
            self._blocks += blocks

    def range(self, first: int, last: int, bins: int, read: Read) -> Extremes:
        """Return the extremes of the rows `first` to before `last` in at most `bins` bins.

        From the rows themselves if there are too few blocks for the bins, else from blocks, whose borders the bins
        then have.
        """
        if last <= first:
            empty = np.zeros((len(self._low), 0))
            return Extremes(np.zeros(0, dtype=np.int64), empty, empty, last)
        block = first // self.block_rows
        end = min(-(-last // self.block_rows), self._blocks)
        if 2 * (end - block) < bins:
            return _of_rows(first, last, bins, read)
        begins = bin_begins(block, end, bins)
        places = begins - block
        low = np.fmin.reduceat(self._low[:, block:end], places, axis=1)
        high = np.fmax.reduceat(self._high[:, block:end], places, axis=1)
        if last > self.rows:  # rows that are no whole block yet belong to the last bin
            rest = read(self.rows, last)
            low[:, -1] = np.fmin(low[:, -1], np.fmin.reduce(rest, axis=1, initial=np.nan))
            high[:, -1] = np.fmax(high[:, -1], np.fmax.reduce(rest, axis=1, initial=np.nan))
        return Extremes(begins * self.block_rows, low, high, max(end * self.block_rows, last))

    def _merge(self) -> None:
        """Merge neighbouring blocks."""
        half = MOST_BLOCKS // 2
        for values, smaller in ((self._low, np.fmin), (self._high, np.fmax)):
            values[:, :half] = smaller(values[:, 0::2], values[:, 1::2])
            values[:, half:] = np.nan
        self._blocks, self.block_rows = half, 2 * self.block_rows


def _of_rows(first: int, last: int, bins: int, read: Read) -> Extremes:
    """Return the extremes of rows in bins, a part of them in memory at a time."""
    begins = bin_begins(first, last, bins)
    borders = np.append(begins, last)
    together = max(len(begins) * ROWS_OF_A_READ // (last - first), 1)
    found = []
    for k in range(0, len(begins), together):
        part = begins[k : k + together]
        values = read(int(part[0]), int(borders[min(k + together, len(begins))]))
        found.append(extremes(values, part - part[0]))
    low, high = (np.concatenate(parts, axis=1) for parts in zip(*found, strict=True))
    return Extremes(begins, low, high, last)
