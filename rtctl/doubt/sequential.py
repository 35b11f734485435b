"""Page's cumulative sum of |z|, a number a window: S = max(0, S + min(|z|, most) - allowance), an alarm at `threshold`.

A single wild window is not enough (its part is bounded), small changes that stay add up. Model error is neither white
nor normal, so no table of run lengths holds: the numbers below are assumptions, and what they give is counted on
simulated unchanged runs (docs/results.md).
Reference: E. S. Page, Biometrika 41 (1954) 100.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

ALLOWANCE = 2.0
"""Part of |z| that does not count, a window."""
MOST = 6.0
"""Largest |z| that counts, so that one window alone does not alarm."""
THRESHOLD = 9.0
"""Sum at which there is an alarm."""


class CumulativeSum:
    """Sums of n numbers; `since` is the window at which the one that alarms last was 0."""

    def __init__(self, numbers: int) -> None:
        self.sums: FloatArray = np.zeros(numbers)
        self._windows = 0
        self._began = np.zeros(numbers, dtype=np.int64)

    def add(self, z: FloatArray) -> bool:
        """Take the numbers (n,) of a window; NaN leaves its sum as it is. Return whether there is an alarm."""
        part = np.where(np.isfinite(z), np.minimum(np.abs(z), MOST) - ALLOWANCE, 0.0)
        self.sums = np.maximum(self.sums + part, 0.0)
        self._windows += 1
        self._began = np.where(self.sums == 0.0, self._windows, self._began)
        return bool(np.max(self.sums) >= THRESHOLD)

    @property
    def windows_since(self) -> int:
        """Windows since the largest sum was 0: the change began about then."""
        return int(self._windows - self._began[int(np.argmax(self.sums))])

    def restart(self) -> None:
        """Forget all sums."""
        self.sums = np.zeros_like(self.sums)
        self._began[:] = self._windows
