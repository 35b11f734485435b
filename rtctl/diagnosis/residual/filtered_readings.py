"""Readings behind a steep low-pass filter that the drive did not pass: an effect of its own, which no cause stands for.

A filter that a user applies to the response alone (forwards and backwards, so that it has no delay) takes away what the
model predicts beyond its edge, and leaves so little noise there that this is seen. A reading has noise at all
frequencies; its spectrum falls steeply only behind a filter, or where the drive's does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord
from rtctl.output.readable_units import readable

STEEP_DB = 30.0
"""Fall in one octave beyond the drive's own: a filter of four poles, twice, falls by 48 dB, a resonator by 12. Of 75
datasets without a filter (69 of devices of the foreign campaign, six files of other habits) 22 dB was the most."""
LENGTH = 1024
"""Samples of a piece whose spectra are averaged."""
EDGES_AN_OCTAVE = 6
LEAST_CELLS = 4
"""Values of a spectrum in an octave from which its quartiles are known."""
FILTERED = (
    "the spectrum of the {name} falls by {fall:.0f} dB in the octave above {edge}, and that of the {drive} does not: "
    "the readings seem to have passed a low-pass filter. A filter of one signal alone is an effect of its own; give "
    "both the same filter, or neither"
)


def describe_filters(problem: Problem) -> list[str]:
    """Return a warning for each output of the records to fit that seems to have passed a filter alone."""
    drive = problem.subject.drive
    driven = [one for one in problem.records if np.ptp(one.stimulus.inputs.get(drive, np.zeros(1))) > 0.0]
    if not driven or problem.subject.is_steady:
        return []
    warnings = []
    for name in dict.fromkeys(output for one in driven for output in one.measured):
        found = _steepest_fall(
            [one for one in driven if name in one.measured], name, drive, problem.scales.rate
        )
        if found is not None and found[1] > STEEP_DB:
            words = name.replace("_", " ")
            warnings.append(
                FILTERED.format(name=words, fall=found[1], edge=readable(found[0], "Hz"), drive=drive)
            )
    return warnings


def _steepest_fall(
    records: Sequence[FitRecord], name: str, drive: str, rate: float
) -> tuple[float, float] | None:
    """Return the edge [Hz] and the fall [dB] of an output in the octave above it, beyond the drive's; None: unknown.

    Levels are quartiles over an octave, the lower one below the edge and the upper one above, which no peak moves. The
    edge is looked for from twice the motion's own frequency `rate` [rad/s] on.
    """
    period_s = min(one.period_s for one in records)
    same = [one for one in records if one.period_s < 1.02 * period_s and one.samples >= LENGTH]
    if not same:
        return None
    response = _density([one.measured[name] for one in same])
    driving = _density([one.stimulus.inputs[drive] for one in same])
    frequency, highest = np.fft.rfftfreq(LENGTH, period_s), 0.2 / period_s
    edge, best = rate / math.pi, None
    while 0.0 < edge < highest:
        below = (frequency > 0.5 * edge) & (frequency <= edge)
        above = (frequency >= 2.0 * edge) & (frequency < 4.0 * edge)
        if min(below.sum(), above.sum()) >= LEAST_CELLS:
            fall = 10.0 * math.log10(_fall(response, below, above) / _fall(driving, below, above))
            if best is None or fall > best[1]:
                best = (edge, fall)
        edge *= 2.0 ** (1.0 / EDGES_AN_OCTAVE)
    return best


def _fall(density: FloatArray, below: NDArray[np.bool_], above: NDArray[np.bool_]) -> float:
    """Return how many times smaller a spectral density is above an edge than below it."""
    return float(np.quantile(density[below], 0.25) / max(np.quantile(density[above], 0.75), 1e-300))


def _density(series: Sequence[FloatArray]) -> FloatArray:
    """Return the mean power (LENGTH // 2 + 1,) of pieces of series (n,), in any unit; 1e-30 of the largest at least."""
    window = np.blackman(LENGTH)
    pieces = [
        one[first : first + LENGTH]
        for one in series
        for first in range(0, len(one) - LENGTH + 1, LENGTH // 2)
    ]
    power = np.mean([np.abs(np.fft.rfft(window * (one - one.mean()))) ** 2 for one in pieces], axis=0)
    found: FloatArray = np.maximum(power, 1e-30 * max(float(power.max()), 1e-300))
    return found
