"""Fewer points with the same look: min/max of buckets against time, one point a cell in a plane.

A panel is about a thousand pixels wide: the points left out would have fallen on pixels that are drawn anyway.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray

IntArray = NDArray[np.intp]

LINE_POINTS = 4000
PLANE_POINTS = 12000


def extremes(values: FloatArray, points: int = LINE_POINTS) -> IntArray:
    """Return indices (at most `points`, ascending) that keep minimum and maximum of each bucket of `values`.

    All of them where there are no more than `points`. A bucket without a number keeps one NaN: the gap.
    """
    count = len(values)
    if count <= points:
        return np.arange(count)
    width = -(-count // (points // 2 - 1))
    buckets = -(-count // width)
    padded = np.full(buckets * width, np.nan)
    padded[:count] = values
    table = padded.reshape(buckets, width)
    first = width * np.arange(buckets)
    lowest = first + np.where(np.isnan(table), np.inf, table).argmin(axis=1)
    highest = first + np.where(np.isnan(table), -np.inf, table).argmax(axis=1)
    return np.unique(np.concatenate([lowest, highest, [0, count - 1]]))


def path_points(*columns: FloatArray) -> IntArray:
    """Return indices (ascending) of a line in a plane that keep the extremes of every column."""
    return np.unique(np.concatenate([extremes(column) for column in columns]))


def visited(x: FloatArray, y: FloatArray, points: int = PLANE_POINTS) -> IntArray:
    """Return indices (at most `points`, ascending) of finite samples: the first in each cell of a grid.

    All finite samples where there are no more than `points`; else the finest grid from 800 cells a side.
    """
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    cells = 800
    kept = finite
    while len(kept) > points:
        _, first = np.unique(
            _cell(x[finite], cells) * (cells + 1) + _cell(y[finite], cells), return_index=True
        )
        kept = finite[np.sort(first)]
        cells = cells * 3 // 4
    return kept


def _cell(values: FloatArray, cells: int) -> IntArray:
    """Return the column of each value when its range is cut into `cells`."""
    low, width = values.min(), np.ptp(values)
    return (
        np.zeros(len(values), np.intp) if width == 0.0 else ((values - low) / width * cells).astype(np.intp)
    )
