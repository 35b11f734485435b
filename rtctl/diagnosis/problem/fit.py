"""Fit a hypothesis: all parameters of the nominal model and of a set of mechanisms, to all records of a problem."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.bounds import bounds
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, minimise, predict_gain
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity

LEAST_DETERMINED = 1e-7
"""Squared share of a parameter's slopes beyond all others': below it, it says what they say."""
MOST_ITERATIONS = 40
KEPT = 2
"""Points of a fit whose derivatives are kept: where it is, and where it went last."""


def fit_hypothesis(
    problem: Problem,
    simulation: Simulation,
    mechanisms: Sequence[str],
    starts: FloatArray | None = None,
    iterations: int = MOST_ITERATIONS,
    still: frozenset[str] = frozenset(),
) -> Hypothesis | None:
    """From the values of `simulation`; None: it diverges there. `starts` (records, states) in units."""
    sensitivity = sensitivity_of(problem, simulation, still)
    sigma = np.array([problem.size(name) for name in sensitivity.outputs])
    values = np.array([one.value for one in simulation.parameters])
    given = [simulation.starting(record.stimulus, values) for record in problem.records]
    if starts is None:
        starts = np.array([[*start, *values[sensitivity.record_parameters]] for start in given])
    cost = SegmentCost(
        sensitivity=sensitivity,
        segments=[
            Segment(record, start, False, near if record.first else None)
            for record, start, near in zip(problem.records, starts, given, strict=True)
        ],
        sigma=sigma,
        executor=problem.executor,
        steps_per_period=problem.steps_per_period,
        cache_size=KEPT,
    )
    begin = cost.start(sensitivity.current_values[sensitivity.free] / sensitivity.scale)
    low, high = bounds(sensitivity, problem.scales)
    found = minimise(
        cost.equations,
        begin,
        low,
        high,
        iterations=iterations,
        tolerance=1e-7,
        should_stop=problem.enough,
        second_derivative=cost.compute_second_derivative,
    )
    if found is None:
        return None
    return _hypothesis(cost, tuple(mechanisms), found, predict_gain(found, low, high), still)


def sensitivity_of(problem: Problem, simulation: Simulation, still: frozenset[str]) -> Sensitivity:
    """Of all parameters but fixed ones and those in `still`; a record's own ones go with its start."""
    free = [k for k, one in enumerate(simulation.parameters) if not one.fixed and one.name not in still]
    apart = [k for k in free if simulation.parameters[k].declared.per_record]
    return Sensitivity.of(simulation, problem.records, free, scales=problem.scales, record_parameters=apart)


def polish(problem: Problem, hypothesis: Hypothesis, iterations: int = MOST_ITERATIONS) -> Hypothesis | None:
    """To the end, with every shape free that these records can determine beside the others."""
    still = set(hypothesis.still)
    redundant = {one.name for one in hypothesis.simulation.parameters if one.declared.redundant}
    for name in _defaulted(hypothesis.simulation, hypothesis.mechanisms)[::-1]:
        if name in still - redundant and _determined(problem, hypothesis, still - {name}, name):
            still.discard(name)
    return fit_hypothesis(
        problem, hypothesis.simulation, hypothesis.mechanisms, hypothesis.starts, iterations, frozenset(still)
    )


def defaulted(simulation: Simulation) -> frozenset[str]:
    """Names of shapes of mechanisms that have a default: they stay there until the rest is known."""
    return frozenset(_defaulted(simulation, tuple(mechanism.id for mechanism in simulation.mechanisms)))


def _defaulted(simulation: Simulation, mechanisms: Sequence[str]) -> list[str]:
    return [
        one.name
        for one in simulation.parameters
        if one.mechanism in mechanisms and one.declared.is_shape and one.declared.default is not None
    ]


def _determined(problem: Problem, hypothesis: Hypothesis, still: set[str], name: str) -> bool:
    """Whether the records tell it from all other free ones: of Bouc-Wen's four numbers one only names the others."""
    again = fit_hypothesis(
        problem, hypothesis.simulation, hypothesis.mechanisms, hypothesis.starts, 0, frozenset(still)
    )
    if again is None:
        return False
    gram = np.zeros((len(again.shared), len(again.shared)))
    try:
        lines = again.linearise(problem)
    except ArithmeticError:
        return False
    for line in lines:
        flat = line.shared.reshape(len(line.shared), -1)
        gram += flat @ flat.T
    sensitivity = again.sensitivity
    names = [sensitivity.simulation.parameters[k].name for k in sensitivity.free]
    own, others = names.index(name), [k for k, other in enumerate(names) if other != name]
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    normal = gram / size[:, None] / size
    border = normal[own, others]
    alike = border @ np.linalg.pinv(normal[np.ix_(others, others)], rcond=1e-12, hermitian=True) @ border
    return bool(gram[own, own] > 0.0 and 1.0 - alike > LEAST_DETERMINED)


def _hypothesis(
    cost: SegmentCost,
    mechanisms: tuple[str, ...],
    found: Minimum,
    gain: float,
    still: frozenset[str],
) -> Hypothesis:
    unknowns = found.unknowns
    values = cost.sensitivity.values(unknowns.shared)
    starts = np.array([cost.state(k, unknowns) for k in range(len(cost.segments))])
    values[cost.sensitivity.record_parameters] = starts[0, len(cost.sensitivity.simulation.state) :]
    return Hypothesis(
        mechanisms=mechanisms,
        simulation=cost.sensitivity.simulation.with_values(values),
        starts=starts,
        cost=found.equations.cost,
        sensitivity=cost.sensitivity,
        shared=unknowns.shared,
        still=still,
        promised=found.equations.cost - gain,
    )
