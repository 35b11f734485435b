"""What the extension gains on records that took no part in the fit: error before, after, the noise, an interval.

The ratio's interval comes from a moving-block bootstrap of both squared errors together: errors are coloured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Prediction, Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.levenberg_marquardt import minimise
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity

RESAMPLES = 400
BLOCK_PERIODS = 8.0
LEAST_BLOCKS = 12
"""Of all test records; shorter ones where they are few periods."""
ITERATIONS = 12
CONVERGED = 1e-6


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
    old = [compute_free_run_error(before, record, output) for record in records]
    new = [compute_free_run_error(after, record, output) for record in records]
    low, high = _interval(old, new, rate, records[0].period_s)
    first, second = _rms(old), _rms(new)
    ratio = first / second if second > 0.0 else math.inf
    return Gain(output, unit, first, second, noise_floor, ratio, low, high)


def compute_free_run_error(
    simulation: Simulation, record: FitRecord, output: str, within: float = 1.0
) -> FloatArray:
    """Simulated minus measured (n,) over the scored samples, from the fitted start; infinite if it diverges."""
    run = simulate_free_run(simulation, record, output, within)
    if run.diverged_at[0] >= 0:
        return np.full(record.samples - record.first, np.inf)
    error: FloatArray = (run.outputs[output][0] - record.measured[output])[record.first :]
    return error


def simulate_free_run(
    simulation: Simulation, record: FitRecord, output: str, within: float = 1.0
) -> Prediction:
    """Of one lane. What is the record's own is fitted to this share of its scored samples, `within`, first.

    That is its start, two numbers: the first sample is noisy, and a lightly damped device rings with that noise for a
    long time; and parameters that each record has for itself, as the phase of a hum. As they are where no fit is.
    """
    values = np.array([parameter.value for parameter in simulation.parameters])

    def run(start: FloatArray | None) -> Prediction:
        try:
            return simulation.predict(record.stimulus, values, start)
        except ValueError:  # no sensible step resolves the model at this record's amplitude
            nothing = {name: np.full((1, record.samples), np.nan) for name in simulation.outputs}
            return Prediction(nothing, np.zeros(1, dtype=np.int64))

    own = [k for k, one in enumerate(simulation.parameters) if one.declared.per_record and not one.fixed]
    if not simulation.state and not own:
        return run(None)
    start = simulation.starting(record.stimulus, values)
    alone = replace(record, measured={output: record.measured[output]})
    seen = alone.truncate(record.first + round(within * (record.samples - record.first)))
    cost = SegmentCost(
        sensitivity=Sensitivity.of(
            simulation,
            [seen],
            own,
            scales=estimate_scales([record], next(iter(record.measured))),
            record_parameters=own,
        ),
        segments=[Segment(seen, np.append(start, values[own]), False, start if record.first else None)],
        sigma=np.array([float(seen.measured[output].std()) or 1.0]),
    )
    nothing = np.empty(0)
    reached = minimise(
        cost.equations, cost.start(nothing), nothing, nothing, iterations=ITERATIONS, tolerance=CONVERGED
    )
    if reached is not None:
        found = cost.state(0, reached.unknowns)
        start, values[own] = found[: len(start)], found[len(start) :]
    return run(np.atleast_2d(start))


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
