"""The misfit of a fitted set over short segments, each from its own initial state: it does not rest on a long memory.

A body without a spring drifts, and whatever is slow fits the drift of a free run; within a segment there is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.nominal_fit.multiple_shooting_start import cut_segments, fit_segments, without_diverging
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.least_squares.levenberg_marquardt import Minimum, minimise
from rtctl.identification.simulation_error.segments import SegmentCost
from rtctl.identification.simulation_error.sensitivity import Sensitivity


def segment_cost(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the cost of the fitted set over short segments; that of the fit where the simulation has no state."""
    if not hypothesis.simulation.state:
        return hypothesis.cost
    return _judge(problem, hypothesis)[0]


def sort_by_segments(problem: Problem, hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return sets in the order of their cost over short segments once they are fitted to these.

    A motion that jumps or bounces has a minimum at every turn of a whole record, and a set that ended in one of them is
    no worse than another for that; over a segment there is one minimum.
    """
    costs = [_cost_once_fitted(problem, one) for one in hypotheses]
    return [hypotheses[k] for k in np.argsort(costs, kind="stable")]


def _cost_once_fitted(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the cost over short segments of a set that is fitted to them; infinite where it diverges."""
    fitted = next(fit_segments(problem, hypothesis.simulation, hypothesis.fixed_parameters), None)
    return np.inf if fitted is None else segment_cost(problem, replace(hypothesis, simulation=fitted))


def segment_rms(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the RMS residual over short segments, over the outputs' sizes, of a simulation that has states."""
    cost, samples = _judge(problem, hypothesis)
    return float(np.sqrt(2.0 * cost / samples)) if samples else np.inf


def misfits_of_segments(problem: Problem, hypothesis: Hypothesis, sized_by: Problem) -> FloatArray:
    """Return the RMS residual (n,) in each short segment, over the outputs' sizes in `sized_by`.

    Segments that diverge from the states that the readings show are left out.
    """
    cost = without_diverging(_cost_of(problem, hypothesis, sized_by), np.empty(0))
    minimum = _minimum(problem, cost)
    pieces = None if minimum is None else cost.compute_terms(minimum.unknowns)
    if pieces is None:
        return np.empty(0)
    samples = [segment.record.samples for segment in cost.segments]
    return np.sqrt(2.0 * np.array([piece.cost for piece in pieces]) / samples)


def _judge(problem: Problem, hypothesis: Hypothesis) -> tuple[float, int]:
    """Return the cost over segments, infinite where one diverges, and the number of samples that they hold."""
    cost = _cost_of(problem, hypothesis, problem)
    minimum = _minimum(problem, cost)
    samples = sum(segment.record.samples for segment in cost.segments)
    return (np.inf if minimum is None else minimum.equations.cost), samples


def _cost_of(problem: Problem, hypothesis: Hypothesis, sized_by: Problem) -> SegmentCost:
    """Return the cost of the fitted set over short segments, as a function of their initial states alone."""
    limits, simulation = problem.thresholds.nominal_fit, hypothesis.simulation
    apart = hypothesis.sensitivity.record_parameters.tolist()
    sensitivity = Sensitivity.of(
        simulation, problem.records, apart, scales=problem.scales, record_parameters=apart
    )
    own = [simulation.parameters[k].value for k in apart]
    return SegmentCost(
        sensitivity=sensitivity,
        segments=cut_segments(problem, simulation, limits.judged_periods, own, limits.max_judged_segments),
        sigma=np.array([sized_by.size(name) for name in sensitivity.outputs]),
        executor=problem.executor,
        steps_per_period=problem.steps_per_period,
    )


def _minimum(problem: Problem, cost: SegmentCost) -> Minimum | None:
    nothing = np.empty(0)
    return minimise(
        cost.equations,
        cost.start(nothing),
        nothing,
        nothing,
        iterations=problem.thresholds.nominal_fit.segment_iterations,
        tolerance=1e-3,
    )
