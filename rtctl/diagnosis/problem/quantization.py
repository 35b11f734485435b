"""The step of the converter that a signal was read with, from the readings alone.

Readings that are levels and nothing else lie on a grid. Where noise is added behind the converter they lie about one:
their characteristic function, the mean of exp(2 pi i x / d), then has a peak at the step d, of exp(-2 pi^2 s^2 / d^2)
for white noise s. Readings may be both: what a coarse converter gave, with noise, and a finer one read.

Reference: B. Widrow, I. Kollar, Quantization Noise (2008), ch. 4.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.thresholds import ProblemThresholds


def quantization_step(readings: Sequence[FloatArray], thresholds: ProblemThresholds) -> float:
    """Return the step of the converter that all `readings`, (n,) each, were read with, of two the coarser one.

    Returns:
        The step in the unit of the readings; 0 where they lie on no grid and about none, or on one too fine to be seen.
    """
    values = np.concatenate(readings)
    exact, below_noise = step_of_levels(values, thresholds), step_below_noise(values, thresholds)
    return below_noise if below_noise > thresholds.quantization_coarser * exact else exact


def step_of_levels(values: FloatArray, thresholds: ProblemThresholds) -> float:
    """Return the step of readings (n,) that are levels of a converter, 0 where they are not.

    The levels must be multiples of the smallest difference of two of them, and each must be met several times.
    """
    levels, count = np.unique(values), len(values)
    gaps = np.diff(levels)
    gaps = gaps[gaps > thresholds.quantization_round_off * (levels[-1] - levels[0])]
    if len(gaps) < 2 or count < thresholds.quantization_readings_per_level * (len(gaps) + 1):
        return 0.0
    step = float(gaps.min())
    off_grid = np.abs(gaps / step - np.round(gaps / step))
    return step if np.all(off_grid < thresholds.quantization_off_grid) else 0.0


def step_below_noise(values: FloatArray, thresholds: ProblemThresholds) -> float:
    """Return the step of a converter in readings (n,) to which noise was added behind it, 0 where none is visible.

    The noise must be below an eighth of the step, and the readings must visit several levels.
    """
    extent = float(np.ptp(values))
    bins, finer = thresholds.quantization_bins, 4
    if not (0.0 < extent < np.inf) or len(values) < thresholds.quantization_least_readings:
        return 0.0
    counts = np.histogram(values, bins)[0] / len(values)
    spectrum = np.abs(np.fft.rfft(counts, finer * bins))  # at `k / (finer extent)` periods a unit
    lowest, highest = finer * thresholds.quantization_least_levels, finer * bins // 32
    for k in range(lowest, highest):
        peak = spectrum[k]
        below = spectrum[k // 4 : 3 * k // 4].max()
        if peak > thresholds.quantization_peak and below < thresholds.quantization_contrast * peak:
            near = spectrum[k : 5 * k // 4]  # two wells make fringes beside the peak
            return _refined(values, (k + int(near.argmax())) / (finer * extent), 1.0 / (finer * extent))
    return 0.0


def _refined(values: FloatArray, frequency: float, within: float) -> float:
    """Return the step of readings (n,) whose characteristic function has its peak `within` of a `frequency`."""
    tried = frequency + within * np.linspace(-1.0, 1.0, 41)
    peaks = [float(np.abs(np.mean(np.exp(2j * np.pi * one * values)))) for one in tried]
    step = 1.0 / float(tried[int(np.argmax(peaks))])
    numbers = np.rint((values - grid_level(values, step)) / step)
    spread = numbers - numbers.mean()
    return float(spread @ values / (spread @ spread))


def grid_level(values: FloatArray, step: float) -> float:
    """Return the level that is nearest to zero of readings (n,) with a `step`, by their mean phase in it."""
    phase = float(np.angle(np.mean(np.exp(2j * np.pi * values / step))))
    return phase * step / (2.0 * np.pi)
