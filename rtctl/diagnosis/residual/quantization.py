"""What the steps of a converter do to a reading: an error that follows the motion, and silence where nothing moves.

Rounding a reading x with white noise to steps d leaves a mean error that is periodic in x with the period d: small
where the noise is as large as d, and its overtones smaller yet. At rest within a step the reading stays the same,
noise and all: such stretches say nothing, and would make the noise look smaller than it is.

What is done about it depends on the readings alone, so that all hypotheses are judged by the same samples.

Reference: B. Widrow, I. Kollar, Quantization Noise (2008), ch. 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rtctl.border.arrays import FloatArray

OVERTONES = 2
"""Of the error, one period a step."""


def rounding_errors(simulated: FloatArray, step: float) -> FloatArray:
    """(directions, n) that the mean error of readings of `simulated` (n,) may follow; empty without a step."""
    if not step > 0.0:
        return np.zeros((0, len(simulated)))
    turns = 2.0 * np.pi * simulated / step
    waves = [wave(k * turns) for k in range(1, OVERTONES + 1) for wave in (np.sin, np.cos)]
    return np.array(waves).reshape(-1, len(simulated))


def heard(readings: FloatArray, step: float, window: int) -> NDArray[np.bool_]:
    """(n,) where `readings` (n,) change within `window` samples about; everywhere without a step."""
    if not step > 0.0:
        return np.ones(len(readings), bool)
    size = max(3, window)
    highest, lowest = maximum_filter1d(readings, size), minimum_filter1d(readings, size)
    found: NDArray[np.bool_] = highest - lowest > 0.5 * step
    return found if found.any() else ~found
