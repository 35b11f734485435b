"""What a model's run over one record needs beside its parameters, fitted to the record: start state, own parameters.

A fit from the model's own start may end in another branch of the motion: in the other well, or half a period late. Then
it is fitted to the record's beginning first, which no branch has left yet, and to ever more of it from there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.levenberg_marquardt import Status, minimise
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity

PARTS = (0.02, 0.06, 0.2)
"""Initial shares of a record to which its unknowns are fitted, one after another."""
LEAST_PER_UNKNOWN = 4
"""Readings of a part for each unknown, least."""
LOST = 0.3
"""Share of the variation (RMS) that a run leaves, beyond which another branch is looked for."""


class RecordUnknowns(NamedTuple):
    """The unknowns of one record."""

    start: FloatArray
    """State (states,) at its first sample, in units."""
    own: FloatArray
    """Values of the parameters that each record has for itself, in units."""


class _Fitted(NamedTuple):
    """Unknowns that were fitted to a part of a record."""

    unknowns: FloatArray
    left: float
    """What they leave of the readings' variation (RMS)."""
    converged: bool


def fit_record_unknowns(
    simulation: Simulation, record: FitRecord, seen: FitRecord, *, iterations: int, tolerance: float
) -> RecordUnknowns:
    """Fit the start state and the own parameters of a record, at the values of the model's other parameters.

    Args:
        simulation: Model at its values.
        record: Record, whose stimulus tells the expected start.
        seen: The part of it, with the outputs, to which they are fitted.
        iterations: Iterations of a fit, at most.
        tolerance: Relative change of the cost at which a fit ends.

    Returns:
        The unknowns; the model's own where no fit succeeds.
    """
    values = np.array([parameter.value for parameter in simulation.parameters])
    free = [k for k, one in enumerate(simulation.parameters) if one.declared.per_record and not one.fixed]
    states = len(simulation.state)
    expected = np.append(simulation.starting(record.stimulus, values), values[free])
    scales = estimate_scales([record], next(iter(record.measured)))
    sizes = [float(one.std()) or 1.0 for one in seen.measured.values()]

    def fitted(part: FitRecord, begin: FloatArray) -> _Fitted | None:
        cost = SegmentCost(
            sensitivity=Sensitivity.of(simulation, [part], free, scales=scales, record_parameters=free),
            segments=[Segment(part, begin, False, expected[:states] if record.first else None)],
            sigma=np.array(sizes),
        )
        nothing = np.empty(0)
        reached = minimise(
            cost.equations, cost.start(nothing), nothing, nothing, iterations=iterations, tolerance=tolerance
        )
        if reached is None:
            return None
        readings = len(sizes) * max(part.samples - part.first, 1)
        left = float(np.sqrt(2.0 * reached.equations.cost / readings))
        return _Fitted(cost.state(0, reached.unknowns), left, reached.status is Status.CONVERGED)

    found = fitted(seen, expected)
    if states and (found is None or found.left > LOST or not found.converged):
        begin = _with_readings(expected, simulation, seen)
        for share in PARTS:
            readings = max(round(share * (seen.samples - seen.first)), LEAST_PER_UNKNOWN * len(expected))
            part = fitted(seen.truncate(seen.first + readings), begin)
            begin = begin if part is None else part.unknowns
        again = fitted(seen, begin)
        found = again if found is None or (again is not None and again.left < found.left) else found
    unknowns = expected if found is None else found.unknowns
    return RecordUnknowns(unknowns[:states], unknowns[states:])


def _with_readings(expected: FloatArray, simulation: Simulation, seen: FitRecord) -> FloatArray:
    """Return the expected unknowns with the first readings of the states that were measured."""
    begin = expected.copy()
    for k, name in enumerate(simulation.state):
        if name in seen.measured:
            begin[k] = seen.measured[name][0]
    return begin
