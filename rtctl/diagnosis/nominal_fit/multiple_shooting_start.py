"""Start values for fits of whole records: the parameters that fit short segments, each from its own initial state.

A lightly damped oscillator whose frequency is off by more than a period in Q has many minima over a whole record, and
a bistable one as many as turns; over a few periods there is one. The segments' states settle first, each at its own
pace: one in the wrong well would drag the parameters with it, and is left out if it stays there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.bounds import parameter_bounds
from rtctl.diagnosis.problem.fit import sensitivity_of
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.thresholds import NominalFitThresholds
from rtctl.identification.least_squares.levenberg_marquardt import Unknowns, minimise
from rtctl.identification.regression.weak_form import choose_half_width
from rtctl.identification.simulation_error.multiple_shooting import cut_segments as cut
from rtctl.identification.simulation_error.multiple_shooting import fit_segment_states
from rtctl.identification.simulation_error.segments import Segment, SegmentCost


def fit_segments(
    problem: Problem,
    simulation: Simulation,
    fixed_parameters: frozenset[str] = frozenset(),
    *,
    settle: bool = True,
) -> Iterator[Simulation]:
    """Fit segments of increasing length, each fit from the values of the one before.

    Args:
        problem: Records to fit.
        simulation: Model at its start values.
        fixed_parameters: Names of parameters that are not fitted.
        settle: Whether the segments' states are fitted before any parameter, and stray segments are left out; else the
            shortest length is skipped and more segments are used.

    Yields:
        The simulation after each length; without those over which it diverges.
    """
    limits = problem.thresholds.nominal_fit
    if not simulation.state or not problem.subject.reads_initial_states:
        return
    for periods in limits.segment_periods if settle else limits.segment_periods[1:]:
        most = limits.max_segments if settle else limits.max_judged_segments
        cost = _cost_of_segments(problem, simulation, fixed_parameters, periods, most)
        sensitivity = cost.sensitivity
        shared = sensitivity.current_values[sensitivity.free] / sensitivity.scale
        cost = without_diverging(cost, shared)
        cost, unknowns = _without_stray(cost, shared, limits) if settle else (cost, cost.start(shared))
        low, high = parameter_bounds(problem, sensitivity)
        minimum = minimise(
            cost.equations,
            unknowns,
            low,
            high,
            iterations=limits.segment_iterations,
            tolerance=1e-4,
            should_stop=problem.enough,
        )
        if minimum is not None:
            simulation = simulation.with_values(sensitivity.values(minimum.unknowns.shared))
            yield simulation


def cut_segments(
    problem: Problem, simulation: Simulation, periods: float, own: Sequence[float], most: int
) -> list[Segment]:
    """Cut the records into segments with their own initial states.

    Args:
        problem: Records to cut.
        simulation: Gives the states' names.
        periods: Length of a segment [periods of the motion].
        own: Parameters that each record has for itself.
        most: Largest number of segments; they are spread evenly over all records.
    """
    length_s = periods * 2.0 * np.pi / problem.scales.rate
    width_s = choose_half_width(problem.records, problem.scales.rate)
    pieces = [piece for record in problem.records for piece in cut(record, simulation, length_s, width_s)]
    chosen = np.linspace(0, len(pieces) - 1, min(most, len(pieces))).round().astype(int)
    return [pieces[k]._replace(joined=False, start=np.append(pieces[k].start, own)) for k in chosen]


def _cost_of_segments(
    problem: Problem, simulation: Simulation, fixed_parameters: frozenset[str], periods: float, most: int
) -> SegmentCost:
    """Return the cost over segments of so many periods."""
    sensitivity = sensitivity_of(problem, simulation, fixed_parameters)
    own = [simulation.parameters[k].value for k in sensitivity.record_parameters]
    return SegmentCost(
        sensitivity=sensitivity,
        segments=cut_segments(problem, simulation, periods, own, most),
        sigma=np.array([problem.size(name) for name in sensitivity.outputs]),
        executor=problem.executor,
        steps_per_period=problem.steps_per_period,
    )


def without_diverging(cost: SegmentCost, shared: FloatArray) -> SegmentCost:
    """Drop the segments that diverge at once: beyond its barrier a softening spring has no motion to fit."""
    unknowns = cost.start(shared)
    kept = [segment for k, segment in enumerate(cost.segments) if cost.linearise(k, unknowns) is not None]
    return cost.with_changes(segments=kept) if kept else cost


def _without_stray(
    cost: SegmentCost, shared: FloatArray, limits: NominalFitThresholds
) -> tuple[SegmentCost, Unknowns]:
    """Fit the states alone, and drop the segments whose cost stays far above the others'."""
    unknowns = fit_segment_states(cost, cost.start(shared), limits.segment_state_tolerance)
    pieces = cost.compute_terms(unknowns)
    if pieces is None:
        return cost, unknowns
    costs = np.array([piece.cost for piece in pieces]) / [one.record.samples for one in cost.segments]
    kept = np.flatnonzero(costs <= limits.stray_segment_ratio * np.median(costs)).tolist()
    cost = cost.with_changes(segments=[cost.segments[k] for k in kept])
    return cost, unknowns._replace(local=unknowns.local[kept])
