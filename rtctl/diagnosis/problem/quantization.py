"""The step of the converter that a signal was read with, from the readings alone.

Reference: B. Widrow, I. Kollar, Quantization Noise (2008), ch. 4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray

ROUND_OFF = 1e-6
"""Of the range: levels that are closer are one."""
ON_THE_GRID = 0.02
"""Steps, by which a level may be off the grid."""
LEAST_READINGS = 2.0
"""A level, on average: readings without steps are all different."""


def quantization_step(readings: Sequence[FloatArray]) -> float:
    """Of the converter that all `readings`, (n,) each, came through; 0 where they lie on no grid or on a fine one."""
    levels, count = np.unique(np.concatenate(readings)), sum(map(len, readings))
    gaps = np.diff(levels)
    gaps = gaps[gaps > ROUND_OFF * (levels[-1] - levels[0])]
    if len(gaps) < 2 or count < LEAST_READINGS * (len(gaps) + 1):
        return 0.0
    step = float(gaps.min())
    return step if np.all(np.abs(gaps / step - np.round(gaps / step)) < ON_THE_GRID) else 0.0
