"""What records that took no part in the fit say of small causes, and of rivals that fit about as well.

Noise that is not autoregressive looks like a small cause, and does not repeat on test records. Where a model may be off
by more than the noise, a likelihood in that noise tells sets apart that differ in nothing but which part of the model's
own error they take up: a set whose error on test records is not certainly larger, in any output, as it is or in units
of the noise, is as good an explanation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import refit_without_each
from rtctl.diagnosis.search.holdout_error import compute_free_run_error, measure_gains
from rtctl.diagnosis.search.outcome import SearchResult, find_equivalents, replace_chosen
from rtctl.identification.fit_record import FitRecord


def drop_unsupported(
    result: SearchResult,
    problem: Problem,
    tests: Sequence[FitRecord],
    ids: Sequence[str],
    budget: WorkBudget,
) -> tuple[SearchResult, tuple[str, ...]]:
    """Drop the small causes without which the error on test records is hardly larger, or smaller.

    The residual tests stay those of the larger set: what remains without such a cause is too small to be one. Nothing
    is dropped once the budget is spent, nor where no test record can be simulated.

    Args:
        result: Outcome of the search.
        problem: Records that were fitted.
        tests: Records that took no part in a fit.
        ids: Mechanisms of the catalogue that are tested.
        budget: Work of the diagnosis.

    Returns:
        The outcome without those causes, and their ids.
    """
    dropped: list[str] = []
    unseparated = problem.thresholds.residual.unseparated_noise * problem.taken_off
    least = problem.thresholds.search.least_support + unseparated
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    while tests and not budget.spent and _causes(result):
        reduced = _list_reduced(result, chosen, problem)
        if not reduced:
            break
        shown = shown_share(chosen, problem)
        error = sum_squared_errors(chosen, problem, tests, shown)
        rest, fewer = min(
            ((sum_squared_errors(one, problem, tests, shown), one) for one in reduced),
            key=lambda pair: pair[0].sum(),
        )
        seen = np.isfinite(error) & np.isfinite(rest)
        if (
            not seen.any()
            or rest[seen].sum() > (1.0 + least) * error[seen].sum()
            or _shows_whitened(result, fewer, problem, tests)
        ):
            break
        dropped += set(chosen.mechanisms) - set(fewer.mechanisms)
        chosen = fewer
        result = (
            choose_smaller(fewer, result, problem, ids) if fewer is not nominal else _choose_nominal(result)
        )
    return result, tuple(dropped)


def drop_minor(
    result: SearchResult, problem: Problem, tests: Sequence[FitRecord], ids: Sequence[str]
) -> tuple[SearchResult, tuple[str, ...]]:
    """Drop the causes of a set that does not pass which remove less than it leaves beyond the noise, the least first.

    What is left has a cause that is not known, and a small law of the catalogue takes up a part of it, whichever it is.
    Fitted records and test records both have to say so: free runs of these may drift for other reasons. One without
    which the error on test records is no larger is dropped as well. Loops that were refitted stay with their set.

    Args:
        result: Outcome of the search.
        problem: Records that were fitted.
        tests: Records that took no part in a fit.
        ids: Mechanisms of the catalogue that are tested.

    Returns:
        The outcome without those causes, but with one at least, and their ids.
    """
    dropped: list[str] = []
    if result.passes or not tests or result.hysteresis_refit is not None or not result.rankings:
        return result, ()
    whole = result.chosen.hypothesis
    beyond = 1.0 - min(noise_cost_of(result.chosen) / whole.cost, 1.0)
    error = sum_squared_errors(whole, problem, tests, shown_share(whole, problem))
    left = beyond * whole.cost, beyond * float(error[np.isfinite(error)].sum())
    while len(_causes(result)) > 1 and result.leave_one_out:
        chosen = result.chosen.hypothesis
        shown = shown_share(chosen, problem)
        error = sum_squared_errors(chosen, problem, tests, shown)
        followed = np.isfinite(error)
        fewer = min(result.leave_one_out, key=lambda one: one.cost)
        without = sum_squared_errors(fewer, problem, tests, shown)  # infinite where it diverges
        back = fewer.cost - chosen.cost, float((without - error)[followed].sum())
        is_minor = back[0] < left[0] and back[1] < left[1]
        if not followed.any() or not (is_minor or back[1] <= 0.0):
            break
        dropped += set(chosen.mechanisms) - set(fewer.mechanisms)
        result = choose_smaller(fewer, result, problem, ids)
    return result, tuple(dropped)


def _list_reduced(result: SearchResult, chosen: Hypothesis, problem: Problem) -> list[Hypothesis]:
    """Return the chosen set without each of its small causes.

    A single cause is small only where all that it removes is small beside the noise.
    """
    limits, nominal = problem.thresholds.search, result.nominal.hypothesis
    removed = nominal.cost - chosen.cost
    all_small = result.passes and removed < limits.small_set_share * chosen.cost
    if len(_causes(result)) == 1:
        return [nominal] if all_small else []
    most = limits.small_removed_share * removed
    return [one for one in result.leave_one_out if all_small or one.cost - chosen.cost < most]


def _choose_nominal(result: SearchResult) -> SearchResult:
    chosen = result.nominal._replace(tests=result.chosen.tests)
    return result._replace(chosen=chosen, equivalent=(), leave_one_out=())


def choose_smaller(
    fewer: Hypothesis, result: SearchResult, problem: Problem, ids: Sequence[str]
) -> SearchResult:
    """Choose `fewer` with the residual tests of the larger set."""
    tested = run_residual_tests(fewer, problem, ids)._replace(tests=result.chosen.tests)
    result = replace_chosen(problem, result, tested)
    return result._replace(
        leave_one_out=refit_without_each(problem, result.nominal.hypothesis, fewer, result.hypotheses),
        equivalent=find_equivalents(problem, result.rankings, tested, plain=not result.passes),
    )


def _shows_whitened(
    result: SearchResult, fewer: Hypothesis, problem: Problem, tests: Sequence[FitRecord]
) -> bool:
    """Return whether an output's error on test records, in units of the noise, is certainly larger without a cause.

    Beside the slow error of a static model, which it is allowed, a small fast effect shows in these units alone.
    """
    if not problem.allowed or not result.passes:
        return False
    least = problem.thresholds.search.whitened_gain
    gains = measure_gains(fewer, result.chosen, problem, tests, whitened=True)
    return any(one.ratio_low > least for one in gains)


def _causes(result: SearchResult) -> set[str]:
    return set(result.chosen.hypothesis.mechanisms) - set(result.nominal.hypothesis.mechanisms)


def shown_share(hypothesis: Hypothesis, problem: Problem) -> float:
    """Return the initial share of a test record to which parameters of a record's own are fitted; 0 without any."""
    of_record = any(parameter.declared.per_record for parameter in hypothesis.simulation.parameters)
    return problem.thresholds.search.shown_share if of_record else 0.0


def sum_squared_errors(
    hypothesis: Hypothesis, problem: Problem, tests: Sequence[FitRecord], shown: float
) -> FloatArray:
    """Return the squared error of each test record (records,), over all outputs in squares of their sizes.

    Args:
        hypothesis: Fitted set.
        problem: Records that were fitted, for the outputs' sizes.
        tests: Test records.
        shown: Initial share of a record to which its own parameters are fitted and that is not counted.
    """
    limits, total = problem.thresholds.search, np.zeros(len(tests))
    for k, record in enumerate(tests):
        for name in hypothesis.sensitivity.outputs:
            if name in record.measured:
                error = compute_free_run_error(hypothesis.simulation, record, name, shown or 1.0, limits)
                total[k] += float(np.sum(error[round(shown * len(error)) :] ** 2)) / problem.size(name) ** 2
    return total


def add_untold_rivals(result: SearchResult, problem: Problem, tests: Sequence[FitRecord]) -> SearchResult:
    """Return the outcome with the rivals of its chosen set that the test records do not tell from it.

    Args:
        result: Outcome of a search.
        problem: Records that were fitted; nothing changes where it allows no misfit.
        tests: Records that took no part in a fit.
    """
    size = len(result.chosen.hypothesis.mechanisms) - len(result.nominal.hypothesis.mechanisms)
    if not (problem.allowed and tests and result.passes and 0 < size <= len(result.rankings)):
        return result
    ranking = [one.hypothesis for one in result.rankings[size - 1]]
    names = set(result.chosen.hypothesis.mechanisms)
    own = next((one for one in ranking if set(one.mechanisms) == names), None)
    if own is None:
        return result
    known = [names, *(set(one.mechanisms) for one in result.equivalent)]
    most = problem.thresholds.search.untold_cost * own.cost
    untold = [
        one
        for one in ranking
        if set(one.mechanisms) not in known
        and one.cost < most
        and not is_told_apart(result.chosen._replace(hypothesis=own), one, problem, tests)
    ]
    return result._replace(equivalent=(*result.equivalent, *untold)) if untold else result


def is_told_apart(
    tested: TestedHypothesis, rival: Hypothesis, problem: Problem, tests: Sequence[FitRecord]
) -> bool:
    """Return whether an output's error on test records is certainly smaller with the tested set than with `rival`."""
    return any(
        one.ratio_low > 1.0
        for whitened in (False, True)
        for one in measure_gains(rival, tested, problem, tests, whitened=whitened)
    )
