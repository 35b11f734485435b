"""Challengers: refit rival sets from where the best fit ended, since theirs may have stopped in a local minimum."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.first_samples import run_search_tests
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.elimination.backward_elimination import refit_without
from rtctl.diagnosis.search.model_selection import best_of_each_set, rank_hypotheses, whitened_bic
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.state import SearchSettings
from rtctl.diagnosis.search.successive_halving import halve_successively


def refit_challengers(
    problem: Problem,
    parents: Sequence[TestedHypothesis],
    fits: Sequence[Hypothesis],
    settings: SearchSettings,
) -> list[Hypothesis]:
    """Refit the sets that the leader leaves far behind, from the nominal parameters that the leader found.

    Where motions jump, a fit ends where the nominal parameters are off, whatever is added. The leader shows where they
    are right, and from there a rival needs only its own size.

    Args:
        problem: Records to fit.
        parents: Sets that were extended.
        fits: Fitted sets, lowest cost first.
        settings: Mechanisms and budget.

    Returns:
        The fits and the refitted challengers, lowest cost first.
    """
    limits, leader = problem.thresholds.search, fits[0]
    parent = next(
        (p.hypothesis for p in parents if set(p.hypothesis.mechanisms) < set(leader.mechanisms)), None
    )
    near = {frozenset(one.mechanisms) for one in fits if leader.cost >= limits.lone_leader_share * one.cost}
    if problem.glance is not problem or parent is None or len(near) == len(fits) or settings.budget.spent:
        return list(fits)
    moved = refit_without(problem, parent, leader, parent.mechanisms, iterations=0)
    if moved is None:
        return list(fits)
    tested = run_search_tests(moved, problem, settings.ids)
    candidates = [
        candidate
        for candidate in propose_candidates(tested, limits, least=limits.challenger_score)
        if frozenset(candidate.mechanisms) not in near
    ]
    refitted = halve_successively(problem, candidates, settings.report, settings.budget)
    return best_of_each_set(sorted([*fits, *refitted], key=lambda one: one.cost))


def refit_rivals(
    problem: Problem, result: SearchResult, larger: TestedHypothesis, settings: SearchSettings
) -> SearchResult:
    """Refit the rivals of a single cause that a larger set led to, from where that cause ended.

    All single causes may have been stuck; where this one came out of it, the others can too.

    Args:
        problem: Records to fit.
        result: Search with the single cause chosen; returned as it is for any other set.
        larger: The set that led to it.
        settings: Mechanisms, significance level and budget.
    """
    chosen, limits = result.chosen, problem.thresholds.search
    added = len(chosen.hypothesis.mechanisms) - len(result.nominal.hypothesis.mechanisms)
    if chosen is larger or added != 1 or not result.rankings:
        return result
    known = [one.hypothesis for one in result.rankings[0] if one.hypothesis is not chosen.hypothesis]
    fits = best_of_each_set([chosen.hypothesis, *sorted(known, key=lambda one: one.cost)])
    fits = refit_challengers(problem, [result.nominal], fits, settings.for_rivals())
    seen = {id(one) for one in (chosen.hypothesis, *known)}
    most = limits.rival_cost * chosen.hypothesis.cost
    refitted = [one for one in fits if id(one) not in seen and one.cost < most]
    if not refitted:
        return result
    tested = [run_residual_tests(one, problem, settings.ids) for one in refitted]
    best = min(
        (chosen, *(one for one in tested if settings.passes(one))),
        key=lambda one: whitened_bic(problem, one.hypothesis, chosen.noise),
    )
    fits = best_of_each_set([best.hypothesis, chosen.hypothesis, *refitted, *known])
    ranking = rank_hypotheses(problem, fits, best, plain=False)
    return result._replace(chosen=best, rankings=(ranking, *result.rankings[1:]))


def list_unfinished(problem: Problem, result: SearchResult) -> tuple[Hypothesis, ...]:
    """Return the equivalents and, where the budget ended the fits of single causes, those that may end as low."""
    chosen = result.chosen.hypothesis
    single = len(chosen.mechanisms) == len(result.nominal.hypothesis.mechanisms) + 1
    if not single or len(result.rankings) != 1:
        return result.equivalent
    known = {id(one) for one in (chosen, *result.equivalent)}
    most = problem.thresholds.search.unfinished_cost * chosen.cost
    near = (one.hypothesis for one in result.rankings[0] if one.hypothesis.cost < most)
    return (*result.equivalent, *(one for one in near if id(one) not in known))
