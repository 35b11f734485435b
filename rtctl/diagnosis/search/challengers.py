"""What could stand in the place of a set of causes, from where its fit ended: others may have been stuck."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.backward_elimination import refit_without
from rtctl.diagnosis.search.candidates import propose_candidates
from rtctl.diagnosis.search.model_selection import rank_hypotheses, whitened_bic
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.successive_halving import best_of_each_set, halve_successively

ALONE = 0.1
"""Times the cost of another: a first below it is right, or the other is stuck."""
RIVALS = 0.5
"""Of the best score, in one linear step from where the first ended: below it, a mechanism is no equal of it."""
UNFINISHED = 4.0
"""Times the cost of the best: where a fit may still end that had no time to."""
NEAR = 1.5
"""Times the cost of the best: beyond, no whitening makes a set its equal."""


def refit_challengers(
    problem: Problem, parents: Sequence[TestedHypothesis], field: Sequence[Hypothesis], ids: Sequence[str],
    report: Callable[[str], None], budget: WorkBudget,
) -> list[Hypothesis]:  # fmt: skip
    """`field`, and where its first leaves others far behind, what of them could stand in its place, from there.

    With a jump between motions a fit ends where the nominal parameters are off, whatever is added; one that found its
    way shows where they are right, and from there an equal needs but its own size.
    """
    first = field[0]
    parent = next(
        (p.hypothesis for p in parents if set(p.hypothesis.mechanisms) < set(first.mechanisms)), None
    )
    near = {frozenset(one.mechanisms) for one in field if first.cost >= ALONE * one.cost}
    if problem.glance is not problem or parent is None or len(near) == len(field):
        return list(field)
    there = None if budget.spent else refit_without(problem, parent, first, parent.mechanisms, iterations=0)
    if there is None:
        return list(field)
    runners = [
        runner
        for runner in propose_candidates(run_residual_tests(there, problem, ids), least=RIVALS)
        if frozenset(runner.mechanisms) not in near
    ]
    return best_of_each_set(
        sorted([*field, *halve_successively(problem, runners, report, budget)], key=lambda one: one.cost)
    )


def refit_rivals(
    problem: Problem, found: SearchResult, larger: TestedHypothesis, ids: Sequence[str], level: float,
    report: Callable[[str], None],
    budget: WorkBudget,
) -> SearchResult:  # fmt: skip
    """`found`, where it is a single cause that a `larger` set led to, beside what could stand in its place, from there.

    Where all single causes had been stuck, that one came out of it shows where the others are right too.
    """
    chosen = found.chosen
    added = len(chosen.hypothesis.mechanisms) - len(found.nominal.hypothesis.mechanisms)
    if chosen is larger or added != 1 or not found.rankings:
        return found
    known = [one.hypothesis for one in found.rankings[0] if one.hypothesis is not chosen.hypothesis]
    field = best_of_each_set([chosen.hypothesis, *sorted(known, key=lambda one: one.cost)])
    field = refit_challengers(
        problem, [found.nominal], field, ids, report, budget.further(budget.thresholds.rivals)
    )
    there = {id(one) for one in (chosen.hypothesis, *known)}
    fresh = [one for one in field if id(one) not in there and one.cost < NEAR * chosen.hypothesis.cost]
    if not fresh:
        return found
    examined = [run_residual_tests(one, problem, ids) for one in fresh]
    best = min(
        (chosen, *(one for one in examined if one.p_value > level)),
        key=lambda one: whitened_bic(problem, one.hypothesis, chosen.noise),
    )
    own = rank_hypotheses(
        problem, best_of_each_set([best.hypothesis, chosen.hypothesis, *fresh, *known]), best, plain=False
    )
    return found._replace(chosen=best, rankings=(own, *found.rankings[1:]))


def list_unfinished(found: SearchResult) -> tuple[Hypothesis, ...]:
    """The equivalents, and where time ran out on single causes those whose fits may yet end as low."""
    chosen = found.chosen.hypothesis
    if len(chosen.mechanisms) != len(found.nominal.hypothesis.mechanisms) + 1 or len(found.rankings) != 1:
        return found.equivalent
    known = {id(one) for one in (chosen, *found.equivalent)}
    near = (one.hypothesis for one in found.rankings[0] if one.hypothesis.cost < UNFINISHED * chosen.cost)
    return (*found.equivalent, *(one for one in near if id(one) not in known))
