"""What the steps of a converter do to a reading: an error that follows the motion, and silence where nothing moves.

Rounding a reading x with white noise to steps d leaves a mean error that is periodic in x with the period d: small
where the noise is as large as d, and its overtones smaller yet. At rest within a step the reading stays the same,
noise and all: such stretches say nothing, and would make the noise look smaller than it is.

Reference: B. Widrow, I. Kollar, Quantization Noise (2008), ch. 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

FloatArray = NDArray[np.float64]
COARSE = 0.3
"""Of the noise: a converter's step above it shows; random readings lie far closer."""
OVERTONES = 2
"""Of the error, one period a step."""


def step_of(readings: FloatArray) -> float:
    """Between neighbouring levels of `readings` (n,); 0 where none can be seen."""
    levels = np.unique(readings)
    return float(np.median(np.diff(levels))) if len(levels) > 2 else 0.0


def rounding_errors(readings: FloatArray, residual: FloatArray) -> FloatArray:
    """(directions, n) that the mean error of `readings` (n,) may follow; `residual` (n,): simulated less them. Empty
    where the steps are fine.
    """
    step = step_of(readings)
    if not step > COARSE * float(np.std(residual)):
        return np.zeros((0, len(readings)))
    turns = 2.0 * np.pi * (residual + readings) / step
    waves = [wave(k * turns) for k in range(1, OVERTONES + 1) for wave in (np.sin, np.cos)]
    return np.array(waves).reshape(-1, len(readings))


def heard(readings: FloatArray, residual: FloatArray, window: int) -> NDArray[np.bool_]:
    """(n,) where `readings` (n,) change within `window` samples about; everywhere where the steps are fine."""
    if not step_of(readings) > COARSE * float(np.std(residual)):
        return np.ones(len(readings), bool)
    size = max(3, window)
    found: NDArray[np.bool_] = maximum_filter1d(readings, size) > minimum_filter1d(readings, size)
    return found if found.any() else ~found
