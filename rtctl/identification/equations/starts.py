"""Sizes of a user's states along a motion, and further starts of a fit that got stuck."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.levenberg_marquardt import minimise
from rtctl.identification.simulation_error.segments import Segment, SegmentCost

SPREAD = 3.0
"""Random starts lie within this factor of the start model's values, where these have no bounds."""
PARTS = 20
"""Pieces of a record from whose own starts the parameters are fitted first."""
LEAST_PART = 30
"""Least samples of a piece."""
ITERATIONS = 30


def trajectory_scales(simulation: Simulation, records: Sequence[FitRecord]) -> tuple[Scales, FloatArray]:
    """Return plain scales, as equations declare their parameters' sizes themselves, and sizes (states,) of the states.

    A size is the largest magnitude along free runs at the simulation's own values, in the state's unit.
    """
    period_s = min(one.period_s for one in records)
    duration_s = max(one.samples * one.period_s for one in records)
    scales = Scales(1.0, 1.0, 1.0, 1.0, 2.0 * np.pi / duration_s, duration_s, period_s, 1.0)
    values = np.array([one.value for one in simulation.parameters])
    found = np.zeros(len(simulation.state))
    for record in records:
        found = np.maximum(found, np.abs(simulation.starting(record.stimulus, values)))
        try:
            run = simulation.predict(record.stimulus, values)
        except ValueError:
            continue
        for k, name in enumerate(simulation.state):
            course = run.outputs[name][0] if name in run.outputs else np.empty(0)
            course = course[np.isfinite(course)]
            if run.diverged_at[0] < 0 and len(course):
                found[k] = max(found[k], float(np.abs(course).max()))
    return scales, np.where(found > 0.0, found, 1.0)


def make_starts(simulation: Simulation, count: int, seed: int) -> list[FloatArray]:
    """Return `count` random starts (parameters,): within bounds where both are given, else within a factor."""
    random = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        values = []
        for one in simulation.parameters:
            share = float(random.random())
            if one.fixed:
                values.append(one.value)
            elif np.isfinite(one.low) and np.isfinite(one.high):
                values.append(one.low + share * (one.high - one.low))
            else:
                size = one.value or float(random.normal())
                values.append(float(np.clip(size * SPREAD ** (2.0 * share - 1.0), one.low, one.high)))
        made.append(np.array(values))
    return made


def shoot(cost: SegmentCost, values: FloatArray) -> list[FloatArray]:
    """Return a start (parameters,) from short pieces of the records, each with a start state of its own.

    A free run over a whole record may lose the motion; pieces of it keep to it. No start is returned where the pieces
    diverge, or the records are short.

    Args:
        cost: Cost of whole records.
        values: Parameters (parameters,) to start from.
    """
    simulation, pieces = cost.sensitivity.simulation, []
    if not set(simulation.state) <= set(simulation.outputs):  # a unit does not show its states
        return []
    for segment in cost.segments:
        record = segment.record
        length = max(LEAST_PART, (record.samples - record.first) // PARTS)
        states = _states_along(simulation, record, values)
        pieces += [
            Segment(record.cut(begin, begin + length), states[begin], False)
            for begin in range(record.first, record.samples - length + 1, length)
        ]
    if len(pieces) < 2 or not simulation.state:
        return []
    apart = cost.with_changes(segments=pieces)
    low, high = cost.sensitivity.bounds
    shared = np.clip(values[cost.sensitivity.free] / cost.sensitivity.scale, low, high)
    found = minimise(apart.equations, apart.start(shared), low, high, iterations=ITERATIONS)
    return [] if found is None else [cost.sensitivity.values(found.unknowns.shared)]


def _states_along(simulation: Simulation, record: FitRecord, values: FloatArray) -> FloatArray:
    """Return the states (samples, states) of a free run, the start's where it diverges; measured ones as measured."""
    start = simulation.starting(record.stimulus, values)
    states = np.tile(start, (record.samples, 1))
    try:
        run = simulation.predict(record.stimulus, values)
    except ValueError:
        return states
    for k, name in enumerate(simulation.state):
        course = record.measured.get(name, run.outputs[name][0])
        states[:, k] = np.where(np.isfinite(course), course, start[k])
    return states
