"""The error that a converter's steps add to a reading: it follows the motion, and hides the noise where nothing moves.

Rounding a reading x with white noise to steps d leaves a mean error that is periodic in x with the period d: small
where the noise is as large as d, and its harmonics smaller yet. At rest within a step the reading stays the same,
noise and all: such samples would make the noise look smaller than it is. What is done about both depends on the
readings alone, so that all hypotheses are judged by the same samples.

Reference: B. Widrow, I. Kollar, Quantization Noise (2008), ch. 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from rtctl.border.arrays import FloatArray


def rounding_error_directions(simulated: FloatArray, step: float, harmonics: int) -> FloatArray:
    """Return the directions that the mean rounding error of a reading may follow.

    Args:
        simulated: Simulated reading (n,), in its unit.
        step: Quantization step in the same unit; 0: none.
        harmonics: Number of harmonics of the error, whose fundamental has one period a step.

    Returns:
        Sines and cosines (2 harmonics, n); (0, n) without a step.
    """
    if not step > 0.0:
        return np.zeros((0, len(simulated)))
    turns = 2.0 * np.pi * simulated / step
    waves = [wave(k * turns) for k in range(1, harmonics + 1) for wave in (np.sin, np.cos)]
    return np.array(waves).reshape(-1, len(simulated))


def changing_samples(readings: FloatArray, step: float, window: int) -> NDArray[np.bool_]:
    """Return where quantized readings change, (n,).

    Args:
        readings: Readings (n,), in their unit.
        step: Quantization step in the same unit; 0: none, and all samples are returned.
        window: Samples around each within which a change counts.
    """
    if not step > 0.0:
        return np.ones(len(readings), bool)
    size = max(3, window)
    highest, lowest = maximum_filter1d(readings, size), minimum_filter1d(readings, size)
    changing: NDArray[np.bool_] = highest - lowest > 0.5 * step
    return changing if changing.any() else ~changing
