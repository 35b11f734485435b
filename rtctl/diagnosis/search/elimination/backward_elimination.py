"""Backward elimination: refit a set of causes without each of them, and drop those that are not needed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.border.work import count_work, metered
from rtctl.diagnosis.problem.bounds import clip_to_bounds
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import RecordRows, project
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.model_selection import whitened_bic
from rtctl.diagnosis.search.outcome import SearchResult, replace_chosen
from rtctl.diagnosis.search.state import SearchSettings
from rtctl.identification.noise.residual_noise import NoiseModel


def eliminate_negligible(problem: Problem, nominal: Hypothesis, chosen: Hypothesis) -> Hypothesis:
    """Return `chosen` without its negligible causes, least first; itself where all of them matter."""
    while len(_list_causes(nominal, chosen)) > 1:
        reduced = refit_without_each(problem, nominal, chosen)
        best = min(reduced, key=lambda one: one.cost, default=None)
        if best is None or best.cost > problem.thresholds.search.negligible_cost * chosen.cost:
            break
        chosen = best
    return chosen


def refit_without_each(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, known: Sequence[Hypothesis] = ()
) -> tuple[Hypothesis, ...]:
    """Refit `chosen` without each of its causes in turn.

    Args:
        problem: Records to fit.
        nominal: Nominal model, which is what a single cause leaves.
        chosen: Fitted set of causes.
        known: Fits of other sets, which are taken where the reduced set is among them.

    Returns:
        The reduced sets, without those that diverge.
    """
    causes = _list_causes(nominal, chosen)
    if len(causes) < 2:
        return (nominal,) if causes else ()
    by_set = {frozenset(one.mechanisms): one for one in (*known, nominal)}
    reduced: list[Hypothesis] = []
    for cause in causes:
        rest = tuple(name for name in chosen.mechanisms if name != cause)
        fit = by_set.get(frozenset(rest)) or refit_without(problem, nominal, chosen, rest)
        reduced += [fit] if fit is not None else []
    return tuple(reduced)


def _list_causes(nominal: Hypothesis, chosen: Hypothesis) -> tuple[str, ...]:
    return tuple(name for name in chosen.mechanisms if name not in nominal.mechanisms)


def refit_without(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, rest: tuple[str, ...],
    iterations: int | None = None, below: float = np.inf,
) -> Hypothesis | None:  # fmt: skip
    """Fit the set `rest` from the values that its parameters have in `chosen`.

    With iterations it starts there or where the remaining parameters compensate for the removed ones to first order,
    whichever has the lower cost: parts of one delay that two laws share would else be left to one of them.

    Args:
        problem: Records to fit.
        nominal: Nominal model.
        chosen: Fitted larger set.
        rest: Mechanisms that remain.
        iterations: Number of iterations; None: that of the thresholds; 0: the cost at the start only.
        below: Cost below which the fit has to start.

    Returns:
        The fit; None where it diverges, or starts at a cost that is not below `below`.
    """
    iterations = problem.thresholds.search.elimination_iterations if iterations is None else iterations
    added = tuple(name for name in rest if name not in nominal.mechanisms)
    simulation = nominal.simulation.extended(added)
    values = {parameter.name: parameter.value for parameter in chosen.simulation.parameters}
    simulation = simulation.with_values(_values_of(simulation, values))
    names = {one.name for one in simulation.parameters}
    fixed_parameters = frozenset(name for name in chosen.fixed_parameters if name in names)
    initial = _remaining_starts(chosen, simulation)
    if iterations:
        values |= _compensate(problem, chosen, rest)
        candidates = [simulation]
        compensated = clip_to_bounds(simulation, _values_of(simulation, values))
        if not takes_far_longer(problem, compensated, simulation):
            candidates.append(compensated)
        fits = [(fit_hypothesis(problem, one, rest, initial, 0, fixed_parameters), one) for one in candidates]
        least, simulation = min(
            ((fit.cost if fit else np.inf, one) for fit, one in fits), key=lambda pair: pair[0]
        )
        if not least < below:
            return None
    return fit_hypothesis(problem, simulation, rest, initial, iterations, fixed_parameters)


def takes_far_longer(problem: Problem, simulation: Simulation, known: Simulation) -> bool:
    """Return whether a run of a model takes far more steps than one of the same model at other values.

    To first order a friction may fade within a speed of nearly zero: one run of a positioning drive's took 80 s then,
    more than the search before it. The first samples show it.
    """
    limits = problem.thresholds.search
    first = problem.initial_part(limits.probed_samples)
    return _steps_of_run(first, simulation) > limits.far_longer * _steps_of_run(first, known)


def _steps_of_run(problem: Problem, simulation: Simulation) -> float:
    """Return the work of one run over all records [steps]; infinite where no sensible step resolves the model."""
    values = np.array([parameter.value for parameter in simulation.parameters])
    with metered() as meter:
        try:
            for record in problem.records:
                simulation.predict(record.stimulus, values, steps_per_period=problem.steps_per_period)
        except (ArithmeticError, ValueError):
            return np.inf
    count_work(meter.steps)
    return meter.steps


def _values_of(simulation: Simulation, values: dict[str, float]) -> FloatArray:
    return np.array([values[one.name] for one in simulation.parameters])


def _remaining_starts(chosen: Hypothesis, simulation: Simulation) -> FloatArray:
    """Return initial states and those record parameters of `chosen` that `simulation` has: (records, ...), in units."""
    starts = chosen.starts[:, : chosen.states]
    if not any(one.declared.per_record and not one.fixed for one in simulation.parameters):
        return starts
    names = {one.name for one in simulation.parameters}
    kept = [
        chosen.states + position
        for position, k in enumerate(chosen.sensitivity.record_parameters.tolist())
        if chosen.simulation.parameters[k].name in names
    ]
    return np.column_stack((starts, chosen.starts[:, kept]))


def _compensate(problem: Problem, chosen: Hypothesis, rest: Sequence[str]) -> dict[str, float]:
    """Return the remaining parameters, by name, to first order if all removed amplitudes went to zero."""
    parameters = [chosen.simulation.parameters[k] for k in chosen.sensitivity.free]
    kept = [k for k, one in enumerate(parameters) if not one.mechanism or one.mechanism in rest]
    removed = [k for k, one in enumerate(parameters) if k not in kept and one.declared.neutral is not None]
    try:
        lines = chosen.linearise(problem)
    except ArithmeticError:
        return {}
    if not removed or not kept:
        return {}
    rows = [
        RecordRows(
            residual=line.residual,
            shared=line.shared[kept],
            local=line.local,
            directions=line.shared[removed],
        )
        for line in lines
    ]
    projected = project(rows, [NoiseModel(np.empty(0), 1.0)] * rows[0].residual.shape[0])
    scale = chosen.sensitivity.scale
    step = (
        chosen.shared[removed] - np.array([parameters[k].declared.neutral for k in removed]) / scale[removed]
    )
    sizes = step * projected.scale[1 + len(kept) :]
    moved = chosen.shared[kept] + (sizes @ projected.followed) / projected.scale[1 : 1 + len(kept)]
    return dict(zip([parameters[k].name for k in kept], (moved * scale[kept]).tolist(), strict=True))


def refit_smaller_sets(
    problem: Problem, result: SearchResult, settings: SearchSettings, *, larger_passes: bool = True
) -> SearchResult:
    """Choose a smaller set where it passes once it is refitted from the larger one.

    In a narrow valley a fit of the smaller set may have stopped short, and then any further cause seems to explain it.

    Args:
        problem: Records to fit.
        result: Search with the larger set chosen.
        settings: Mechanisms and significance level.
        larger_passes: Whether the larger set passes; if not, only refits that start below their former cost go on.
    """
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    known = {frozenset(one.mechanisms): one.cost for one in (*result.hypotheses, nominal)}
    causes = _list_causes(nominal, chosen)
    for cause in causes if len(causes) > 1 else ():
        rest = tuple(name for name in chosen.mechanisms if name != cause)
        former = known.get(frozenset(rest), np.inf)
        fit = refit_without(problem, nominal, chosen, rest, below=np.inf if larger_passes else former)
        share = problem.thresholds.search.improved_share
        if fit is not None and had_stopped_short(fit.cost, former, chosen.cost, share):
            tested = run_residual_tests(fit, problem, settings.ids)
            if settings.passes(tested):
                return replace_chosen(problem, result, tested)
    return result


def had_stopped_short(cost: float, former: float, larger: float, share: float) -> bool:
    """Return whether a smaller set, refitted to `cost`, had stopped short at the cost `former`.

    Near a kink the residual tests show what no cost does: a little lower is enough where the refit is as low as the
    `larger` set, to the relative difference `share`.
    """
    return cost < (1.0 - share) * former or (cost < former and cost < (1.0 + share) * larger)


def drop_inactive_causes(problem: Problem, result: SearchResult, ids: Sequence[str]) -> SearchResult:
    """Drop causes of which all amplitudes ended at zero, beside others; the larger set's residual tests still hold."""
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    amplitudes = [one for one in chosen.simulation.parameters if one.declared.neutral is not None]
    active = {
        one.mechanism for one in amplitudes if one.declared.per_record or one.value != one.declared.neutral
    }
    rest = tuple(name for name in chosen.mechanisms if name in nominal.mechanisms or name in active)
    if rest == chosen.mechanisms or len(rest) == len(nominal.mechanisms):
        return result
    fewer = refit_without(problem, nominal, chosen, rest, iterations=0)
    return result if fewer is None else _keep_tests(problem, result, fewer, ids)


def drop_causes_within_allowance(problem: Problem, result: SearchResult, ids: Sequence[str]) -> SearchResult:
    """Drop causes that all together remove no more than the misfit that a nominal model is allowed.

    The larger set passes the residual tests, and what the smaller one leaves beyond that is no gap.
    """
    samples = sum(record.samples - record.first for record in problem.records)
    most = 0.5 * samples * sum(square / problem.size(name) ** 2 for name, square in problem.allowed.items())
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    while problem.allowed and len(chosen.mechanisms) > len(nominal.mechanisms) + 1:
        reduced = refit_without_each(problem, nominal, chosen, result.hypotheses)
        fewer = min(reduced, key=lambda one: one.cost, default=None)
        if fewer is None or fewer.cost > result.chosen.hypothesis.cost + most:
            break
        chosen = fewer
    return result if chosen is result.chosen.hypothesis else _keep_tests(problem, result, chosen, ids)


def drop_unneeded_causes(
    problem: Problem, nominal: Hypothesis, chosen: TestedHypothesis, ids: Sequence[str], level: float
) -> tuple[TestedHypothesis, tuple[Hypothesis, ...]]:
    """Return a set without the causes that its records do not need, tested, and the fits without each of the others.

    A cause is needed where BIC or a residual test says so: others were taken up in other records.

    Args:
        problem: Records to fit.
        nominal: Nominal model, fitted to them.
        chosen: Set that passes.
        ids: Mechanisms of the catalogue.
        level: Level of significance of the residual tests.
    """
    while True:
        reduced = refit_without_each(problem, nominal, chosen.hypothesis)
        fewer = min(reduced, key=lambda one: one.cost, default=None)
        if fewer is None or not _list_causes(nominal, fewer):
            return chosen, reduced
        bic, of_fewer = (whitened_bic(problem, one, chosen.noise) for one in (chosen.hypothesis, fewer))
        if of_fewer > bic:
            return chosen, reduced
        tested = run_residual_tests(fewer, problem, ids)
        if not tested.p_value > level:
            return chosen, reduced
        chosen = tested


def _keep_tests(
    problem: Problem, result: SearchResult, fewer: Hypothesis, ids: Sequence[str]
) -> SearchResult:
    """Choose `fewer` with the residual tests of the larger set."""
    tested = run_residual_tests(fewer, problem, ids)._replace(tests=result.chosen.tests)
    return replace_chosen(problem, result, tested)


def drop_negligible_causes(problem: Problem, result: SearchResult, settings: SearchSettings) -> SearchResult:
    """Drop causes that hardly matter beside those that were found after them, and test what remains."""
    fewer = eliminate_negligible(problem, result.nominal.hypothesis, result.chosen.hypothesis)
    if fewer is result.chosen.hypothesis:
        return result
    result = replace_chosen(problem, result, run_residual_tests(fewer, problem, settings.ids))
    return result._replace(passes=settings.passes(result.chosen))
