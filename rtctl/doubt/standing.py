"""A reading that stands still, to the bit, while its model's moves away and stays away."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

STUCK = 20.0
"""Errors of the model by which its reading must have moved."""
ROWS = 20
"""Rows in which it must have been there: a late device has answered by then."""


class Standing:
    """Feed it rows, in order."""

    def __init__(self, error: float) -> None:
        """Begin; `error`: the model's error of the reading, in the measure of `expected`."""
        self._far = STUCK * error
        self._value = self._from = np.nan
        self._apart = 0

    def add(self, sensed: FloatArray, expected: FloatArray) -> bool:
        """Take rows; return whether the reading that ends them is stuck.

        Args:
            sensed: the reading (n,) [its unit].
            expected: the model's reading (n,), in the measure of its error.
        """
        changes = np.flatnonzero(np.diff(sensed))
        begin = int(changes[-1]) + 1 if len(changes) else 0
        if len(changes) or sensed[0] != self._value:
            self._value, self._from, self._apart = float(sensed[-1]), float(expected[begin]), 0
        self._apart += int(np.count_nonzero(np.abs(expected[begin:] - self._from) > self._far))
        return self._apart >= ROWS
