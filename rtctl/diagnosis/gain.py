"""What the extension gains on records that took no part in the fit: error before, after, the noise, an interval.

The ratio's interval comes from a moving-block bootstrap of both squared errors together: errors are coloured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.simulation import Prediction, Simulation
from rtctl.identification.fit_record import FitRecord

FloatArray = NDArray[np.float64]
RESAMPLES = 400
BLOCK_PERIODS = 8.0
LEAST_BLOCKS = 12
"""Of all test records; shorter ones where they are few periods."""
START_ITERATIONS = 4
NUDGE = 1e-4
"""Of the largest reading: finite differences of the start."""


class Gain(NamedTuple):
    """RMS errors of one output over the test records, in its unit."""

    output: str
    unit: str
    before: float
    after: float
    noise_floor: float
    ratio: float
    ratio_low: float
    ratio_high: float


def gain(
    before: Simulation,
    after: Simulation,
    records: Sequence[FitRecord],
    output: str,
    unit: str,
    noise_floor: float,
    rate: float,
) -> Gain | None:
    """Free runs of both models over `records`; `rate` [1/s] of the motion sets the blocks. None without records."""
    if not records:
        return None
    old = [free_run_error(before, record, output) for record in records]
    new = [free_run_error(after, record, output) for record in records]
    low, high = _interval(old, new, rate, records[0].period_s)
    first, second = _rms(old), _rms(new)
    ratio = first / second if second > 0.0 else math.inf
    return Gain(output, unit, first, second, noise_floor, ratio, low, high)


def free_run_error(simulation: Simulation, record: FitRecord, output: str) -> FloatArray:
    """Simulated minus measured (n,) over the scored samples, from the fitted start; infinite if it diverges."""
    run = free_run(simulation, record, output)
    if run.diverged_at[0] >= 0:
        return np.full(record.samples - record.first, np.inf)
    error: FloatArray = (run.outputs[output][0] - record.measured[output])[record.first :]
    return error


def free_run(simulation: Simulation, record: FitRecord, output: str) -> Prediction:
    """Of one lane. Its start is fitted to the record, two numbers: the first sample is noisy, and a lightly damped
    device rings with that noise for a long time. By Gauss-Newton; the record's own start where that is no better.
    """
    values = np.array([parameter.value for parameter in simulation.parameters])
    if not simulation.state:
        return simulation.predict(record.stimulus, values)
    start = np.array([record.stimulus.initial.get(name, 0.0) for name in simulation.state])
    peak = float(np.abs(record.measured[output]).max()) or 1.0
    steps = NUDGE * peak * np.array([1.0, 1.0 / (10.0 * record.period_s)])[: len(start)]
    best, least = simulation.predict(record.stimulus, values, np.atleast_2d(start)), np.inf
    for _ in range(START_ITERATIONS):
        lanes = start + np.vstack((np.zeros(len(start)), np.diag(steps)))
        run = simulation.predict(record.stimulus, np.tile(values, (len(lanes), 1)), lanes)
        outputs = run.outputs[output][:, record.first :]
        error = outputs[0] - record.measured[output][record.first :]
        if (run.diverged_at >= 0).any() or not float(error @ error) < least:
            break
        best, least = _first_lane(run), float(error @ error)
        slopes = (outputs[1:] - outputs[0]).T / steps
        start = start - np.linalg.lstsq(slopes, error)[0]
    return best


def _first_lane(run: Prediction) -> Prediction:
    return Prediction({name: values[:1] for name, values in run.outputs.items()}, run.diverged_at[:1])


def _rms(errors: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _interval(
    old: Sequence[FloatArray], new: Sequence[FloatArray], rate: float, period_s: float
) -> tuple[float, float]:
    """95 % of the ratio of RMS errors."""
    length = max(8, round(BLOCK_PERIODS * 2.0 * np.pi / rate / period_s))
    length = max(1, min(length, sum(len(one) for one in old) // LEAST_BLOCKS))
    squares = []
    for first, second in zip(old, new, strict=True):
        count = max(1, len(first) // length)
        for part in zip(np.array_split(first, count), np.array_split(second, count), strict=True):
            squares.append([float(np.sum(piece**2)) for piece in part])
    table = np.array(squares)
    if not np.isfinite(table).all():
        return 0.0, math.inf
    draws = np.random.default_rng(0).integers(0, len(table), (RESAMPLES, len(table)))
    sums = table[draws].sum(axis=1)
    ratios = np.sqrt(sums[:, 0] / np.maximum(sums[:, 1], 1e-300))
    low, high = np.percentile(ratios, [2.5, 97.5])
    return float(low), float(high)
