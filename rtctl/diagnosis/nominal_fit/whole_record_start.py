"""Fits of whole records from several starts: the model's own values, levelled offsets, and short segments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.nominal_fit.multiple_shooting_start import fit_segments
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem


def fit_from_starts(problem: Problem, simulation: Simulation, mechanisms: Sequence[str]) -> Hypothesis | None:
    """Return the fit of whole records from the model's own values, or the best of several starts where that is far off.

    A jump between motions makes many minima: where the lowest is far off from every start, more segments are tried,
    and a constant of the reading that may hide the motion. Of long sweeps chosen rows are fitted before all.

    Returns:
        None where the model diverges from every start.
    """
    if problem.subject.is_steady and problem.glance.samples < problem.samples:
        first = fit_from_starts(problem.glance, simulation, mechanisms)
        return None if first is None else fit_hypothesis(problem, first.simulation, mechanisms)
    limits = problem.thresholds.nominal_fit
    own = fit_hypothesis(problem, simulation, mechanisms)
    if own is not None and relative_misfit(problem, own) < limits.close_misfit:
        return own
    starts = (*_with_levelled_offsets(problem, simulation), *fit_segments(problem, simulation))
    trials = [fit_hypothesis(problem, one, mechanisms, iterations=limits.trial_iterations) for one in starts]
    nearest = _by_cost(trials)[: limits.fitted_starts]
    fits = _by_cost(
        [own, *(fit_hypothesis(problem, one.simulation, mechanisms, one.starts) for one in nearest)]
    )
    if fits and not relative_misfit(problem, fits[0]) >= limits.close_misfit:
        return fits[0]
    more = fit_segments(problem, simulation, settle=False)
    fits = _by_cost([*fits, *(fit_hypothesis(problem, start, mechanisms) for start in more)])
    remaining = relative_misfit(problem, fits[0]) if fits else np.inf
    beside_constant = _fit_beside_constant(problem, simulation, mechanisms, remaining)
    if beside_constant is not None:
        return beside_constant
    return fits[0] if fits else None


def refit_from_segments(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """Refit the same set from the values of short segments, if that is better; unchanged where it is not far off.

    Initial states are tried as the readings tell them, too: those of a fit in another valley may lead back to it.
    """
    limits = problem.thresholds.nominal_fit
    if relative_misfit(problem, hypothesis) < limits.close_misfit:
        return hypothesis
    mechanisms, starts, fixed_parameters = (
        hypothesis.mechanisms,
        hypothesis.starts,
        hypothesis.fixed_parameters,
    )
    trials = [
        fit_hypothesis(problem, start, mechanisms, states, limits.trial_iterations, fixed_parameters)
        for start in fit_segments(problem, hypothesis.simulation, fixed_parameters)
        for states in (starts, None)
    ]
    fits = [
        fit_hypothesis(problem, one.simulation, mechanisms, one.starts, fixed_parameters=fixed_parameters)
        for one in _by_cost(trials)[: limits.fitted_starts]
    ]
    return _by_cost([hypothesis, *fits])[0]


def _with_levelled_offsets(problem: Problem, simulation: Simulation) -> list[Simulation]:
    """Return the simulation with offsets that put the outputs' means right, if one is off by more than all motion."""
    if not problem.subject.output_offsets:
        return []
    values = np.array([one.value for one in simulation.parameters])
    names = [one.name for one in simulation.parameters]
    runs = [simulation.predict(record.stimulus, values) for record in problem.records]
    moved = values.copy()
    for output, offset in problem.subject.output_offsets.items():
        readings = [record.measured.get(output) for record in problem.records]
        if (
            offset not in names
            or not any(y is not None for y in readings)
            or simulation.parameters[names.index(offset)].fixed
        ):
            continue
        errors = np.concatenate(
            [y - run.outputs[output][0] for y, run in zip(readings, runs, strict=True) if y is not None]
        )
        signal = np.concatenate([y for y in readings if y is not None])
        if abs(float(errors.mean())) > problem.thresholds.nominal_fit.offset_ratio * float(signal.std()):
            moved[names.index(offset)] += float(errors.mean())
    return [] if (moved == values).all() else [simulation.with_values(moved)]


def _fit_beside_constant(
    problem: Problem, simulation: Simulation, mechanisms: Sequence[str], remaining: float
) -> Hypothesis | None:
    """Return the nominal model with the values of a fit beside a constant of the reading, if that is what is missing.

    A constant that is many times the motion is fitted by any other motion about that place, and no cause is a
    neighbour of that.

    Args:
        problem: Records to fit.
        simulation: The nominal model.
        mechanisms: Ids of its mechanisms.
        remaining: Relative misfit of the fit without a constant.

    Returns:
        None where the readings have no such mean, or the misfit beside the constant is not far below `remaining`.
    """
    constant, limits = problem.subject.offset_mechanism, problem.thresholds.nominal_fit
    if not constant or constant in mechanisms or not _mean_hides_motion(problem, limits.offset_ratio):
        return None
    readings = [record.measured[problem.subject.output] for record in problem.records]
    beside = simulation.extended((constant,))
    values = np.array([one.value for one in beside.parameters])
    values[[one.mechanism == constant for one in beside.parameters]] = np.mean([y.mean() for y in readings])
    start = beside.with_values(values)
    starts = [start, *fit_segments(problem, start)]
    fits = _by_cost([fit_hypothesis(problem, one, (*mechanisms, constant)) for one in starts])
    if not fits or not relative_misfit(problem, fits[0]) < limits.offset_misfit_ratio * remaining:
        return None
    own = [one.value for one in fits[0].simulation.parameters if one.mechanism != constant]
    nominal = simulation.with_values(np.array(own))
    return fit_hypothesis(problem, nominal, mechanisms, fits[0].starts, iterations=0)


def _mean_hides_motion(problem: Problem, ratio: float) -> bool:
    """Return whether the mean of every record is more than `ratio` times its variation."""
    readings = [record.measured.get(problem.subject.output) for record in problem.records]
    return all(y is not None and abs(float(y.mean())) > ratio * float(y.std()) for y in readings)


def _by_cost(fits: Sequence[Hypothesis | None]) -> list[Hypothesis]:
    """Return the fits that did not diverge, lowest cost first."""
    return sorted((one for one in fits if one is not None), key=lambda one: one.cost)
