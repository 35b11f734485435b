"""Fit a hypothesis: all parameters of the nominal model and of a set of mechanisms, to all records of a problem."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.bounds import exceeds_record_bounds, parameter_bounds
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, minimise, predict_gain
from rtctl.identification.simulation_error.segments import Segment, SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity


def fit_hypothesis(
    problem: Problem,
    simulation: Simulation,
    mechanisms: Sequence[str],
    starts: FloatArray | None = None,
    iterations: int | None = None,
    fixed_parameters: frozenset[str] = frozenset(),
) -> Hypothesis | None:
    """Fit a model to all records of a problem, from the values of `simulation`, by output error.

    Args:
        problem: Records to fit.
        simulation: Nominal model extended by the mechanisms, at the values where the fit starts.
        mechanisms: Ids of the mechanisms of the set.
        starts: Initial states and record parameters to start from (records, states + record parameters), in units;
            None: what the readings and `simulation` tell.
        iterations: Iterations at most; None: `thresholds.problem.most_iterations`; 0 evaluates without a step.
        fixed_parameters: Names of parameters that are not fitted.

    Returns:
        The hypothesis at its optimum; None where the model diverges at the start values, or an amplitude of a record
        (that of a hum) ends beyond its bound.
    """
    sensitivity = sensitivity_of(problem, simulation, fixed_parameters)
    cost = _segment_cost(problem, sensitivity, starts)
    low, high = parameter_bounds(problem, sensitivity)
    minimum = minimise(
        cost.equations,
        cost.start(sensitivity.current_values[sensitivity.free] / sensitivity.scale),
        low,
        high,
        iterations=problem.thresholds.problem.most_iterations if iterations is None else iterations,
        tolerance=1e-7,
        should_stop=problem.enough,
        second_derivative=cost.compute_second_derivative,
    )
    if minimum is None:
        return None
    gain = predict_gain(minimum, low, high)
    fitted = _hypothesis(cost, tuple(mechanisms), minimum, gain, fixed_parameters)
    beyond = exceeds_record_bounds(problem, sensitivity, fitted.starts[:, fitted.states :])
    return None if beyond else fitted


def _segment_cost(problem: Problem, sensitivity: Sensitivity, starts: FloatArray | None) -> SegmentCost:
    """Return the cost of whole records; where the first samples are not scored, states stay near what they show."""
    simulation = sensitivity.simulation
    values = np.array([parameter.value for parameter in simulation.parameters])
    given = [simulation.starting(record.stimulus, values) for record in problem.records]
    if starts is None:
        starts = np.array([[*start, *values[sensitivity.record_parameters]] for start in given])
    return SegmentCost(
        sensitivity=sensitivity,
        segments=[
            Segment(record, start, False, near if record.first else None)
            for record, start, near in zip(problem.records, starts, given, strict=True)
        ],
        sigma=np.array([problem.size(name) for name in sensitivity.outputs]),
        executor=problem.executor,
        steps_per_period=problem.steps_per_period,
        cache_size=problem.thresholds.problem.kept_derivatives,
    )


def sensitivity_of(problem: Problem, simulation: Simulation, fixed_parameters: frozenset[str]) -> Sensitivity:
    """Return the sensitivity by all parameters but the fixed ones and those in `fixed_parameters`.

    Parameters that each record has for itself are fitted with its initial state; a shape at its simplest value stays
    there where the law has no derivative by it.
    """
    parameters = simulation.parameters
    free = [
        k
        for k, one in enumerate(parameters)
        if not one.fixed and one.name not in fixed_parameters and not one.declared.stays_at(one.value)
    ]
    of_record = [k for k in free if parameters[k].declared.per_record]
    return Sensitivity.of(
        simulation, problem.records, free, scales=problem.scales, record_parameters=of_record
    )


def polish(problem: Problem, hypothesis: Hypothesis, iterations: int | None = None) -> Hypothesis | None:
    """Fit a hypothesis to its optimum, with every shape free that the records identify beside the other parameters."""
    fixed_parameters = set(hypothesis.fixed_parameters)
    redundant = {
        one.name
        for one in hypothesis.simulation.parameters
        if one.declared.redundant or one.declared.stays_at(one.value)
    }
    for name in _defaulted_shapes(hypothesis.simulation, hypothesis.mechanisms)[::-1]:
        if name in fixed_parameters - redundant and _is_identifiable(
            problem, hypothesis, fixed_parameters - {name}, name
        ):
            fixed_parameters.discard(name)
    return fit_hypothesis(
        problem,
        hypothesis.simulation,
        hypothesis.mechanisms,
        hypothesis.starts,
        iterations,
        frozenset(fixed_parameters),
    )


def predict_with_free_shapes(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the cost that a linear step promises once the shapes at their defaults are free.

    It is infinite where there are none, or where the model diverges.
    """
    shapes = _defaulted_shapes(hypothesis.simulation, hypothesis.mechanisms)
    freed = {
        one.name
        for one in hypothesis.simulation.parameters
        if one.name in hypothesis.fixed_parameters
        and one.name in shapes
        and not (one.declared.redundant or one.declared.stays_at(one.value))
    }
    if not freed:
        return np.inf
    fit = fit_hypothesis(
        problem,
        hypothesis.simulation,
        hypothesis.mechanisms,
        hypothesis.starts,
        0,
        hypothesis.fixed_parameters - freed,
    )
    return np.inf if fit is None else fit.predicted_cost


def defaulted(simulation: Simulation) -> frozenset[str]:
    """Return the names of the shapes that have a default value or set a unit; they stay until the rest is known."""
    return frozenset(_defaulted_shapes(simulation, [mechanism.id for mechanism in simulation.mechanisms]))


def _defaulted_shapes(simulation: Simulation, mechanisms: Sequence[str]) -> list[str]:
    return [
        one.name
        for one in simulation.parameters
        if one.mechanism in mechanisms
        and one.declared.is_shape
        and (one.declared.default is not None or one.declared.redundant)
    ]


def _is_identifiable(problem: Problem, hypothesis: Hypothesis, fixed_parameters: set[str], name: str) -> bool:
    """Return whether the records tell a parameter from all other free ones, by its squared sensitivity."""
    start = fit_hypothesis(
        problem,
        hypothesis.simulation,
        hypothesis.mechanisms,
        hypothesis.starts,
        0,
        frozenset(fixed_parameters),
    )
    if start is None:
        return False
    try:
        records = start.linearise(problem)
    except ArithmeticError:
        return False
    gram = np.zeros((len(start.shared), len(start.shared)))
    for record in records:
        flat = record.shared.reshape(len(record.shared), -1)
        gram += flat @ flat.T
    sensitivity = start.sensitivity
    names = [sensitivity.simulation.parameters[k].name for k in sensitivity.free]
    own, others = names.index(name), [k for k, other in enumerate(names) if other != name]
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    normal = gram / size[:, None] / size
    border = normal[own, others]
    explained = border @ np.linalg.pinv(normal[np.ix_(others, others)], rcond=1e-12, hermitian=True) @ border
    least = problem.thresholds.problem.least_determined_share
    return bool(gram[own, own] > 0.0 and 1.0 - explained > least)


def _hypothesis(
    cost: SegmentCost,
    mechanisms: tuple[str, ...],
    minimum: Minimum,
    gain: float,
    fixed_parameters: frozenset[str],
) -> Hypothesis:
    unknowns = minimum.unknowns
    values = cost.sensitivity.values(unknowns.shared)
    starts = np.array([cost.state(k, unknowns) for k in range(len(cost.segments))])
    values[cost.sensitivity.record_parameters] = starts[0, len(cost.sensitivity.simulation.state) :]
    return Hypothesis(
        mechanisms=mechanisms,
        simulation=cost.sensitivity.simulation.with_values(values),
        starts=starts,
        cost=minimum.equations.cost,
        sensitivity=cost.sensitivity,
        shared=unknowns.shared,
        fixed_parameters=fixed_parameters,
        predicted_cost=minimum.equations.cost - gain,
    )
