"""Noise of a recorded input that the device never felt: what it does to a residual, and how much of it there is.

A force cell or a current probe adds noise of its own to what it reads. The simulation is driven by it and the device is
not, so the residual is the noise's response, and it is correlated with the recorded input: an error in variables. Tests
for what a model lacks find that correlation, best where the true motion is small. The noise is known, though: it is the
part of the recorded input that stands at its floor, in pieces of the record where and at frequencies at which nothing
else is. Its response is one direction, with a known sign: of the whole of it the device felt none (1) or all (0).

References: T. Soederstroem, Automatica 43 (2007) 939 (errors in variables); S. Boll, IEEE TASSP 27 (1979) 113, for the
separation by spectra of short pieces.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, uniform_filter1d
from scipy.signal import detrend
from scipy.signal.windows import hann

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection import estimate_noise, project
from rtctl.diagnosis.residual.testing import ResidualAnalysis

PIECES = (512, 256, 128, 64)
"""Samples of a piece; a record has four of them or more."""
BAND = 8
"""Frequencies of a piece whose powers are taken together."""
QUIETEST = 0.05
"""Share of all bands and pieces that is taken as quiet at first."""
AT_FLOOR = 2.0
"""Power over the floor up to which a band holds nothing else."""
BLOW, AT_REST, AROUND = 20.0, 4.0, 3
"""Peak of an input of blows and the largest value of its noise between them, over that noise (RMS, by the median), and
samples around a blow that are left to it."""
ALIKE = 0.3
"""Correlation of neighbouring samples between blows, in size, up to which nothing but noise is there."""
LEAST_FLOOR = 1e-9
"""Noise over the input (RMS) that no instrument has: below it the input is a computed one."""


class InputNoise(NamedTuple):
    """Noise of a recorded input that the device did not feel."""

    rms: float
    """In the input's unit."""
    share: float
    """What the device did not feel of the noise at the input's floor: 1 is all."""
    left: float
    """RMS of its response over that of the residual, of the output where that is largest."""


def find_input_noise(analysis: ResidualAnalysis) -> tuple[ResidualAnalysis, InputNoise] | None:
    """Find noise of the recorded input in a residual.

    Returns:
        The residual without its response, under a noise model of its own, and what was found; None where the residual
        does not show it, or shows a multiple of it that noise of the record cannot be, or where the readings have a
        step: samples at rest tell nothing then, and are left out.
    """
    if analysis.is_quantized:
        return None
    problem, thresholds = analysis.problem, analysis.problem.thresholds.residual
    noises = [
        separate_noise(one.stimulus.inputs.get(problem.subject.drive, np.empty(0))) for one in problem.records
    ]
    if not any(one.any() for one in noises):
        return None
    responses = [_response(analysis, index, one) for index, one in enumerate(noises)]
    if not all(np.isfinite(one).all() for one in responses):
        return None
    rows = [replace(row, directions=one[None]) for row, one in zip(analysis.rows, responses, strict=True)]
    projected = project(rows, analysis.noise, thresholds)
    share, statistic = -float(projected.step(len(rows[0].shared))[0]), float(projected.single()[0])
    low, high = thresholds.input_noise_shares
    if not (low < share < high and statistic > thresholds.least_input_noise):
        return None
    cleared = tuple(
        replace(row, residual=row.residual - share * one)
        for row, one in zip(analysis.rows, responses, strict=True)
    )
    subject = problem.subject
    noise = estimate_noise(
        cleared,
        resonances=subject.resonances(analysis.hypothesis.simulation),
        slow=not problem.allowed,
        starts_white=subject.noise_starts_white,
        thresholds=thresholds,
        executor=problem.executor,
    )
    found = InputNoise(
        rms=float(np.sqrt(np.mean(np.concatenate(noises) ** 2))),
        share=share,
        left=_largest_ratio(responses, [row.residual for row in analysis.rows]) * share,
    )
    without = replace(
        analysis, rows=cleared, noise=tuple(noise), projected=project(cleared, noise, thresholds)
    )
    return without, found


def separate_noise(values: FloatArray) -> FloatArray:
    """Return the part (n,) of a recorded signal (n,) that stands at the floor of its spectra; zeros where none does.

    The spectrum of each of many short pieces is compared with the floor of all: what is at the floor is noise, of what
    is above it the share that the floor has (Wiener). Mean and slope of a piece are signal. Long pieces tell slow
    noise, short ones avoid the edges of steps: those count that separate most. Between blows all is noise.
    """
    rms = float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
    if not 0.0 < rms < np.inf:
        return np.zeros(len(values))
    parts = [_separate(values, length, LEAST_FLOOR * rms) for length in PIECES if 4 * length <= len(values)]
    parts.append(_between_blows(values))
    return max(parts, key=lambda one: float(one @ one), default=np.zeros(len(values)))


def _between_blows(values: FloatArray) -> FloatArray:
    """Return the noise (n,) of an input that rests between short blows; zeros of any other input."""
    rest = values - np.median(values)
    size = 1.4826 * float(np.median(np.abs(rest)))
    struck = np.abs(rest) > AT_REST * size
    if not 0.0 < BLOW * size < np.abs(rest).max() or struck.mean() > 0.5:
        return np.zeros(len(values))
    noise: FloatArray = np.where(binary_dilation(struck, iterations=AROUND), 0.0, rest)
    alike = float(noise[1:] @ noise[:-1]) / max(float(noise @ noise), 1e-300)
    return noise if abs(alike) < ALIKE else np.zeros(len(values))


def _separate(values: FloatArray, length: int, least: float) -> FloatArray:
    """Return the noise (n,) by pieces of `length`; zeros where the floor is at most `least` (RMS)."""
    hop, window = length // 2, np.sqrt(hann(length, sym=False))
    padded = np.pad(values, (hop, length + hop - len(values) % hop), mode="reflect", reflect_type="odd")
    begins = np.arange(0, len(padded) - length + 1, hop)
    pieces = detrend(padded[begins[:, None] + np.arange(length)], axis=1) * window
    spectra = np.fft.rfft(pieces, axis=1)
    power = uniform_filter1d(np.abs(spectra) ** 2, BAND, axis=1, mode="nearest") / float(window @ window)
    floor = _find_floor(power[:, BAND // 2 :: BAND])
    if not floor > least**2:
        return np.zeros(len(values))
    share = np.where(power < AT_FLOOR * floor, 1.0, floor / np.maximum(power, floor))
    noise, weight = np.zeros(len(padded)), np.zeros(len(padded))
    for begin, piece in zip(begins, np.fft.irfft(share * spectra, length, axis=1) * window, strict=True):
        noise[begin : begin + length] += piece
        weight[begin : begin + length] += window**2
    found: FloatArray = (noise / np.maximum(weight, 0.5))[hop : hop + len(values)]
    return found


def _find_floor(power: FloatArray) -> float:
    """Return the mean power (pieces, bands) of those that are at the floor."""
    floor = float(np.quantile(power, QUIETEST))
    at_floor: NDArray[np.bool_] = power <= AT_FLOOR * floor
    return float(power[at_floor].mean()) if at_floor.any() else floor


def _response(analysis: ResidualAnalysis, index: int, noise: FloatArray) -> FloatArray:
    """Return what a part (n,) of the recorded input does to the simulated outputs of a record, (outputs, n)."""
    hypothesis, record = analysis.hypothesis, analysis.problem.records[index]
    drive, whole = analysis.problem.subject.drive, record.stimulus
    if not noise.any():
        return np.zeros_like(analysis.rows[index].residual)
    quiet = replace(whole, inputs={**whole.inputs, drive: whole.inputs[drive] - noise})
    start = np.atleast_2d(hypothesis.start(index))
    values = hypothesis.values_of(index)
    with_noise, without = (hypothesis.simulation.predict(one, values, start) for one in (whole, quiet))
    return np.stack(
        [
            (with_noise.outputs[name] - without.outputs[name])[0, record.first :]
            for name in hypothesis.sensitivity.outputs
        ]
    )


def _largest_ratio(numerators: list[FloatArray], denominators: list[FloatArray]) -> float:
    over, under = (np.concatenate(one, axis=1) for one in (numerators, denominators))
    return float(np.sqrt((over**2).mean(axis=1) / np.maximum((under**2).mean(axis=1), 1e-300)).max())
