"""Tones in the noise: an autoregression follows them, so that a machine beside the bench would pass for noise.

A tone stands in every record at the same frequency, far above the spectrum on both sides of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import group_by_period

TONES = (
    "the noise of the {} holds a tone of {:.2g} {} at {:.4g} Hz in every record: something that the drive does not "
    "know of, such as a machine beside the bench. It is taken for noise; without it smaller effects would show"
)


class Tone(NamedTuple):
    """A tone that stands in every record."""

    frequency: float
    """Frequency [cycles per sample]."""
    amplitude: float
    """Amplitude in the output's unit."""


def describe_tones(
    errors: Mapping[str, Sequence[FloatArray]], problem: Problem, units: Mapping[str, str]
) -> list[str]:
    """Return a warning for each tone in the residual, the largest of an output first.

    Args:
        errors: Residual (n,) of each record by output, from `bursts.simulation_errors`.
        problem: Problem with the records.
        units: Units of the outputs.
    """
    warnings: list[str] = []
    thresholds = problem.thresholds.residual
    group = max(group_by_period([record.period_s for record in problem.records]), key=len)
    for name, series in errors.items():
        chosen = [series[k] for k in group if len(series[k]) >= thresholds.tone_least_samples]
        if not chosen:
            continue
        size = float(np.sqrt(np.mean(np.concatenate(chosen) ** 2)))
        for tone in find_tones(chosen, thresholds)[: thresholds.most_tones]:
            if tone.amplitude > thresholds.tone_least_share * np.sqrt(2.0) * size:
                frequency_hz = tone.frequency / problem.records[group[0]].period_s
                unit = units.get(name, "")
                warnings.append(TONES.format(name.replace("_", " "), tone.amplitude, unit, frequency_hz))
    return warnings


def find_tones(errors: Sequence[FloatArray], thresholds: ResidualThresholds) -> list[Tone]:
    """Return the tones that stand in the spectra of all `errors`, (n,) each, the largest first."""
    length = min(len(error) for error in errors)
    window = np.hanning(length)
    power = np.array([np.abs(np.fft.rfft(window * (error[:length] - error.mean()))) ** 2 for error in errors])
    around = np.array([median_filter(one, thresholds.tone_neighbours) for one in power])
    height = np.min(power / np.maximum(around, 1e-300), axis=0)  # in every record
    height[:3] = 0.0
    amplitude = 2.0 * np.sqrt(power.mean(axis=0)) / window.sum()
    tones = []
    while height.max() > thresholds.tone_height:
        k = int(np.argmax(np.where(height > thresholds.tone_height, amplitude, 0.0)))
        tones.append(Tone(interpolate_peak(power.mean(axis=0), k) / length, float(amplitude[k])))
        height[max(0, k - 3) : k + 4] = 0.0
    return tones


def interpolate_peak(power: FloatArray, k: int) -> float:
    """Return the position of the peak at bin `k` [bins], by the parabola through the logarithms of three bins.

    A bin is half a turn over the record: that far off, a strong tone would leave so much that the autoregression of
    the noise model took the rest for noise.
    """
    if not 0 < k < len(power) - 1 or not min(power[k - 1], power[k + 1]) > 0.0:
        return float(k)
    left, here, right = np.log(power[k - 1 : k + 2])
    bend = left - 2.0 * here + right
    return float(k + (0.5 * (left - right) / bend if bend < 0.0 else 0.0))
