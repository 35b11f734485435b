"""The step of the converter that a signal was read with, from the readings alone.

Reference: B. Widrow, I. Kollar, Quantization Noise (2008), ch. 4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.thresholds import ProblemThresholds


def quantization_step(readings: Sequence[FloatArray], thresholds: ProblemThresholds) -> float:
    """Return the step of the converter that all `readings`, (n,) each, were read with.

    The levels of the readings must be multiples of the smallest difference of two of them, and each must be met
    several times.

    Returns:
        The step in the unit of the readings; 0 where they lie on no grid, or on one too fine to be seen.
    """
    levels, count = np.unique(np.concatenate(readings)), sum(map(len, readings))
    gaps = np.diff(levels)
    gaps = gaps[gaps > thresholds.quantization_round_off * (levels[-1] - levels[0])]
    if len(gaps) < 2 or count < thresholds.quantization_readings_per_level * (len(gaps) + 1):
        return 0.0
    step = float(gaps.min())
    off_grid = np.abs(gaps / step - np.round(gaps / step))
    return step if np.all(off_grid < thresholds.quantization_off_grid) else 0.0
