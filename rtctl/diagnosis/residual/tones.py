"""Whether the noise holds tones: an autoregression follows them, so what a machine beside the bench does is noise.

A tone stands in every record at the same frequency, far above the spectrum on both sides of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import median_filter

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.noise.residual_noise import group_by_period

STANDS_OUT = 60.0
"""Times the median power on both sides, in each record: noise gets to 20 once in a million bins."""
AROUND = 21
"""Bins that the median is taken of: few, since noise may fall with frequency as steeply as a random walk does."""
LEAST = 256
"""Samples of a record that has a spectrum."""
WORTH_SAYING = 0.2
"""Of what is left [RMS]."""
MOST = 3
TONES = (
    "the noise of the {} holds a tone of {:.2g} {} at {:.4g} Hz in every record: something that the drive does not "
    "know of, such as a machine beside the bench. It is taken for noise; without it smaller effects would show"
)


def tones(left: Mapping[str, Sequence[FloatArray]], problem: Problem, units: Mapping[str, str]) -> list[str]:
    """Warnings, of the `leftovers` of the records of `data`, the largest tones first."""
    said: list[str] = []
    together = max(group_by_period([record.period_s for record in problem.records]), key=len)
    for name, errors in left.items():
        chosen = [errors[k] for k in together if len(errors[k]) >= LEAST]
        if not chosen:
            continue
        size = float(np.sqrt(np.mean(np.concatenate(chosen) ** 2)))
        for frequency, amplitude in _standing_out(chosen)[:MOST]:
            if amplitude > WORTH_SAYING * np.sqrt(2.0) * size:
                frequency_hz = frequency / problem.records[together[0]].period_s
                said.append(
                    TONES.format(name.replace("_", " "), amplitude, units.get(name, ""), frequency_hz)
                )
    return said


def _standing_out(errors: Sequence[FloatArray]) -> list[tuple[float, float]]:
    """Frequencies [1/samples] and amplitudes, the largest first."""
    length = min(len(error) for error in errors)
    window = np.hanning(length)
    power = np.array([np.abs(np.fft.rfft(window * (error[:length] - error.mean()))) ** 2 for error in errors])
    around = np.array([median_filter(one, AROUND) for one in power])
    height = np.min(power / np.maximum(around, 1e-300), axis=0)  # in every record
    height[:3] = 0.0
    amplitude = 2.0 * np.sqrt(power.mean(axis=0)) / window.sum()
    found = []
    while height.max() > STANDS_OUT:
        k = int(np.argmax(np.where(height > STANDS_OUT, amplitude, 0.0)))
        found.append((k / length, float(amplitude[k])))
        height[max(0, k - 3) : k + 4] = 0.0
    return found
