"""From the nominal model to sets of causes: screen by projected scores, race the fits, rank, let the gate decide.

One effect, else two, else three and more, one at a time: from the third on only the best set grows, because a real
device is never exactly the model and passes no gate: by a cause that halves what is left, or by a small third one
where two leave far more than the noise. A larger set is looked for only where no smaller one passes. While nothing
passes, sets are ranked by plain cost: the noise is not known then, and what whitens a misfit hides it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.multiple_shooting_start import fine_enough, fitted_again, over_stretches
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.noise_floor import left_over_noise
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.backward_elimination import (
    eliminate_negligible,
    refit_without,
    refit_without_each,
)
from rtctl.diagnosis.search.candidates import GROWN, interleave, propose_candidates, propose_pairs
from rtctl.diagnosis.search.challengers import NEAR, list_unfinished, refit_challengers, refit_rivals
from rtctl.diagnosis.search.model_selection import (
    RankedHypothesis,
    plain_bic,
    rank_hypotheses,
    select_likeliest,
    whitened_bic,
)
from rtctl.diagnosis.search.outcome import NEARLY, SearchResult
from rtctl.diagnosis.search.successive_halving import best_of_each_set, halve_successively

LARGEST_SET = 6
BEAM = 3
"""Best sets of one size that are extended to the next."""
ALIKE = 8
AS_GOOD = 1.02
"""Times the lowest cost: so close, white squares do not say which is right, and the gate is asked of each."""
NEAR_BEST = 3.0
"""Times the lowest cost: beyond, a set is not extended."""
CLOSE = 1.5
"""Times the lowest cost: among these a misfit's size alone says little."""
AGAIN = 2
"""Best sets of one size that are fitted once more from short stretches where none passes."""
STALLED = (0.8, 0.5, 0.5, 0.25)
"""By size, the last for all larger ones: a set that leaves more than this share of what the smaller one left is the
last."""
ANOTHER = 3
WORTH_ANOTHER = 0.92
"""Instead, for the third cause of a measured device: two that are right leave far more than the noise, and what is
small beside them is real."""
FAR_ABOVE_NOISE = 3.0
WORTH_TELLING = 0.5
EQUIVALENT = 10.0
"""Difference of BIC below which data do not decide between two sets."""
LEVEL = 0.2
"""Of the rate of false claims, that of the gate: noise that is no autoregression makes its p-values a little small."""
NEEDED = 10.0
"""Difference of BIC by which a larger set must beat the smaller ones."""
STUCK = 0.5
"""Times the cost of the nominal model: one that ends so low from elsewhere had not ended where it should."""
MOVED = 1e-4
"""Of the cost: a fit that starts elsewhere and ends lower by more had stopped short."""


def as_it_is(found: SearchResult) -> SearchResult:
    """Nothing is put right."""
    return found


def search(
    problem: Problem,
    nominal: Hypothesis,
    ids: Sequence[str],
    false_claim_rate: float,
    report: Callable[[str], None] = lambda text: None,
    kept: Callable[[SearchResult], None] = lambda found: None,
    budget: WorkBudget | None = None,
    correct: Callable[[SearchResult], SearchResult] = as_it_is,
) -> SearchResult:
    """The causes of what `nominal`, fitted, gets wrong. `kept` hears what is known so far, should `told` raise.

    `put_right`: mends the model behind two causes that do not explain it, or behind the last ones, if that helps.
    """
    budget = budget or WorkBudget.of()
    found = _grown(problem, nominal, ids, significance_level(false_claim_rate), report, kept, budget, correct)
    found = found._replace(out_of_time=budget.spent and not found.passes)
    found = found._replace(equivalent=list_unfinished(found)) if found.out_of_time else found
    if found.hysteresis_refit is not None:
        return found
    without = refit_without_each(
        found.refined_problem or problem, found.nominal.hypothesis, found.chosen.hypothesis, found.hypotheses
    )
    return found._replace(leave_one_out=without)


def significance_level(false_claim_rate: float) -> float:
    """Of the gate: a larger p-value passes."""
    return LEVEL * false_claim_rate


def _grown(
    problem: Problem, nominal: Hypothesis, ids: Sequence[str], level: float,
    report: Callable[[str], None], kept: Callable[[SearchResult], None], budget: WorkBudget,
    correct: Callable[[SearchResult], SearchResult],
) -> SearchResult:  # fmt: skip
    at_nominal = run_residual_tests(nominal, problem, ids)
    passes = at_nominal.p_value > level
    kept(SearchResult(at_nominal, at_nominal, passes, (), ()))
    if passes:
        return SearchResult(at_nominal, at_nominal, True, (), ())
    parents, tried, best, asked = [at_nominal], list[tuple[RankedHypothesis, ...]](), at_nominal, problem

    def answer(found: SearchResult, *, plain: bool = False) -> SearchResult:
        same = find_equivalents(problem, found.rankings, found.chosen, plain=plain)
        return found._replace(equivalent=same, refined_problem=None if problem is asked else problem)

    for size in range(1, LARGEST_SET + 1):
        parents = parents if size <= GROWN else [best]
        groups = [propose_candidates(parent) for parent in parents]
        if size == 2:
            groups = [propose_pairs(at_nominal), *groups]
        field = halve_successively(problem, interleave(groups), report, budget)
        if not field:
            break
        lower = _unstuck(problem, nominal, field[0]) if size == 1 else None
        if lower is not None:
            return _grown(problem, lower, ids, level, report, kept, budget, correct)

        def from_there(
            ones: Sequence[Hypothesis],
            parents: Sequence[TestedHypothesis] = parents,
            problem: Problem = problem,
        ) -> list[Hypothesis]:
            return refit_challengers(problem, parents, ones, ids, report, budget)

        field, near = from_there(field), NEAR_BEST if size < GROWN else CLOSE
        last, (best, parents) = best, _front(problem, field, ids, level, near, from_there, budget)
        if not best.p_value > level:
            problem, best, parents = _at_steps_it_needs(problem, best, parents, ids, budget)
        passes = best.p_value > level
        if passes and not _needed(problem, last, best):
            found = _returned(problem, SearchResult(at_nominal, last, True, (), tuple(tried)), ids, level)
            return answer(refit_rivals(problem, found, last, ids, level, report, budget))
        field = [*(one.hypothesis for one in parents), *field]
        tried.append(rank_hypotheses(problem, best_of_each_set(field), best, plain=not passes))
        kept(SearchResult(at_nominal, best, False, (), tuple(tried)))
        found = SearchResult(at_nominal, best, True, (), tuple(tried))
        if passes or not budget.spent:
            found = _returned(problem, found, ids, level, passes=passes)
        if passes or found.chosen is not best:
            found = _less_what_is_allowed(problem, _less_what_is_idle(problem, found, ids), ids)
            return answer(refit_rivals(problem, found, best, ids, level, report, budget))
        report(f"{size} causes do not explain it")
        problem.cancellation.raise_if_cancelled()
        if size == GROWN and not budget.spent:
            mended = correct(SearchResult(at_nominal, best, False, (), tuple(tried)))
            if mended.passes:
                return mended
        if best.hypothesis.cost > _stalled(size, last) * last.hypothesis.cost:
            best = best if _worth_telling(last, best) else last
            break
        if budget.spent:
            break
    found = _trimmed(problem, SearchResult(at_nominal, best, False, (), tuple(tried)), ids, level)
    return answer(found, plain=not found.passes)


def _at_steps_it_needs(
    problem: Problem,
    best: TestedHypothesis,
    parents: list[TestedHypothesis],
    ids: Sequence[str],
    budget: WorkBudget,
) -> tuple[Problem, TestedHypothesis, list[TestedHypothesis]]:
    """As they are, or with finer steps where those of `data` are what `best` leaves and `budget` lasts."""
    if budget.spent:
        return problem, best, parents
    finer, again = fine_enough(problem.until(budget), best.hypothesis)
    if finer.steps_per_period == problem.steps_per_period:
        return problem, best, parents
    problem = replace(problem, steps_per_period=finer.steps_per_period)
    best = run_residual_tests(again, problem, ids)
    others = (one for one in parents if one.hypothesis.mechanisms != again.mechanisms)
    return problem, best, [best, *others]


def _unstuck(problem: Problem, nominal: Hypothesis, first: Hypothesis) -> Hypothesis | None:
    """The nominal model from where the best single cause led, if it begins there below where it had ended, and ends
    far below: then it was stuck, and the cause is a way around.
    """
    lower = refit_without(problem, nominal, first, nominal.mechanisms, below=nominal.cost)
    return lower if lower is not None and lower.cost < STUCK * nominal.cost else None


def replace_chosen(problem: Problem, found: SearchResult, fewer: TestedHypothesis) -> SearchResult:
    """`found` with `fewer` chosen, and ranked among the sets of its size."""
    size = len(fewer.hypothesis.mechanisms) - len(found.nominal.hypothesis.mechanisms)
    known = [one.hypothesis for one in found.rankings[size - 1]]
    own = rank_hypotheses(
        problem, best_of_each_set([fewer.hypothesis, *known]), fewer, plain=not found.passes
    )
    return found._replace(chosen=fewer, rankings=(*found.rankings[: size - 1], own, *found.rankings[size:]))


def _returned(
    problem: Problem, found: SearchResult, ids: Sequence[str], level: float, *, passes: bool = True
) -> SearchResult:
    """Less one cause, where the smaller set passes once it is fitted from where the larger one ended.

    In a narrow valley a fit of the smaller set may have stopped short: then whatever is added seems to explain it.
    Where not even the larger set `passes`, only what begins lower than it had ended before is fitted.
    """
    nominal, chosen = found.nominal.hypothesis, found.chosen.hypothesis
    known = {frozenset(one.mechanisms): one.cost for one in (*found.hypotheses, nominal)}
    causes = [name for name in chosen.mechanisms if name not in nominal.mechanisms]
    for cause in causes if len(causes) > 1 else ():
        rest = tuple(name for name in chosen.mechanisms if name != cause)
        most = known.get(frozenset(rest), np.inf)
        one = refit_without(problem, nominal, chosen, rest, below=np.inf if passes else most)
        if one is not None and _had_stopped_short(one.cost, most, chosen.cost):
            examined = run_residual_tests(one, problem, ids)
            if examined.p_value > level:
                return replace_chosen(problem, found, examined)
    return found


def _had_stopped_short(cost: float, before: float, larger: float) -> bool:
    """Whether a smaller set, fitted again to `cost`, had not been at its end: near a kink the gate tells what no cost
    does, so also where it is lower by little but as low as the `larger` set.
    """
    return cost < (1.0 - MOVED) * before or (cost < before and cost < (1.0 + MOVED) * larger)


def _less_what_is_idle(problem: Problem, found: SearchResult, ids: Sequence[str]) -> SearchResult:
    """Less the causes beside others of which all sizes ended at nothing: without them the motion is the same, and what
    the gate says of the larger set holds.
    """
    nominal, chosen = found.nominal.hypothesis, found.chosen.hypothesis
    sizes = [one for one in chosen.simulation.parameters if one.declared.neutral is not None]
    acting = {one.mechanism for one in sizes if one.declared.per_record or one.value != one.declared.neutral}
    rest = tuple(name for name in chosen.mechanisms if name in nominal.mechanisms or name in acting)
    if rest == chosen.mechanisms or len(rest) == len(nominal.mechanisms):
        return found
    fewer = refit_without(problem, nominal, chosen, rest, iterations=0)
    if fewer is None:
        return found
    return replace_chosen(
        problem, found, run_residual_tests(fewer, problem, ids)._replace(tests=found.chosen.tests)
    )


def _less_what_is_allowed(problem: Problem, found: SearchResult, ids: Sequence[str]) -> SearchResult:
    """Less the causes that all together remove no more than what a nominal model may be off by.

    The gate's verdict is the larger set's: it passes, and what the smaller one leaves beyond that is no gap.
    """
    samples = sum(record.samples - record.first for record in problem.records)
    most = 0.5 * samples * sum(square / problem.size(name) ** 2 for name, square in problem.allowed.items())
    chosen = found.chosen.hypothesis
    while problem.allowed and len(chosen.mechanisms) > len(found.nominal.hypothesis.mechanisms) + 1:
        rests = refit_without_each(problem, found.nominal.hypothesis, chosen, found.hypotheses)
        fewer = min(rests, key=lambda one: one.cost, default=None)
        if fewer is None or fewer.cost > found.chosen.hypothesis.cost + most:
            break
        chosen = fewer
    if chosen is found.chosen.hypothesis:
        return found
    return replace_chosen(
        problem, found, run_residual_tests(chosen, problem, ids)._replace(tests=found.chosen.tests)
    )


def _stalled(size: int, last: TestedHypothesis) -> float:
    """Share of what a smaller set left, above which one of `size` is the last."""
    if size == ANOTHER and left_over_noise(last) > FAR_ABOVE_NOISE:
        return WORTH_ANOTHER
    return STALLED[min(size, len(STALLED)) - 1]


def _trimmed(problem: Problem, found: SearchResult, ids: Sequence[str], level: float) -> SearchResult:
    """Less the causes that hardly matter beside those that were found after them."""
    fewer = eliminate_negligible(problem, found.nominal.hypothesis, found.chosen.hypothesis)
    if fewer is found.chosen.hypothesis:
        return found
    found = replace_chosen(problem, found, run_residual_tests(fewer, problem, ids))
    return found._replace(passes=found.chosen.p_value > level)


def _worth_telling(smaller: TestedHypothesis, larger: TestedHypothesis) -> bool:
    """Whether a set that does not explain the data is still to be told: it halves what is left."""
    return larger.hypothesis.cost < WORTH_TELLING * smaller.hypothesis.cost


def _needed(problem: Problem, smaller: TestedHypothesis, larger: TestedHypothesis) -> bool:
    """Whether the larger set is worth its parameters: what the gate found in the smaller one may be chance."""
    before, after = (whitened_bic(problem, one.hypothesis, larger.noise) for one in (smaller, larger))
    return before - after > NEEDED


def _front(
    problem: Problem,
    field: Sequence[Hypothesis],
    ids: Sequence[str],
    rate: float,
    near: float,
    from_there: Callable[[Sequence[Hypothesis]], list[Hypothesis]],
    budget: WorkBudget,
) -> tuple[TestedHypothesis, list[TestedHypothesis]]:
    """The one that passes best, else the lowest cost; and those within `near` times that, to extend if none passes.

    Where those that extend do not pass, others as good are asked too, one after the other, while `budget` lasts.
    """
    likely = select_likeliest(problem, field[:BEAM])
    alike = [one for one in field[:ALIKE] if one.cost < AS_GOOD * field[0].cost]
    front = [field[0]] if likely is field[0] else [field[0], likely]
    examined = [run_residual_tests(one, problem, ids) for one in front]
    if all(one.p_value <= rate for one in examined) and not budget.spent:
        few = [one for one in field[:BEAM] if one.cost < near * field[0].cost]
        again = [*(fitted_again(problem.until(budget), one) for one in few[:AGAIN]), *few[AGAIN:]]
        again = from_there(sorted(again, key=lambda one: one.cost))
        again = _by_stretches(problem, [one for one in again if one.cost < near * again[0].cost])
        known = {id(one.hypothesis): one for one in examined}
        examined = [known.get(id(one)) or run_residual_tests(one, problem, ids) for one in again]
    passing = [one for one in examined if one.p_value > rate]
    if passing:
        return max(passing, key=lambda one: one.p_value), examined
    seen = {id(one.hypothesis) for one in examined}
    for one in alike:
        if id(one) not in seen and not budget.spent:
            further = run_residual_tests(one, problem, ids)
            if further.p_value > rate:
                return further, [*examined, further]
    return _all_but_passing(examined) or examined[0], examined[:BEAM]


def _all_but_passing(examined: Sequence[TestedHypothesis]) -> TestedHypothesis | None:
    """The one that leaves little, where the first leaves more: kinks keep a fit from its end, and the gate sees
    how near it is.
    """
    nearest = max(examined, key=lambda one: one.p_value)
    return nearest if nearest.p_value > NEARLY >= examined[0].p_value else None


def _by_stretches(problem: Problem, field: Sequence[Hypothesis]) -> list[Hypothesis]:
    """`field` by cost, but those as good as the first in the order of what they leave within short stretches."""
    close = [one for one in field if one.cost < CLOSE * field[0].cost]
    if len(close) > 1:
        left = {id(one): over_stretches(problem, one) for one in close}
        close.sort(key=lambda one: left[id(one)])
    return [*close, *field[len(close) :]]


def find_equivalents(
    problem: Problem,
    tried: Sequence[Sequence[RankedHypothesis]],
    best: TestedHypothesis,
    *,
    plain: bool = False,
) -> tuple[Hypothesis, ...]:
    """Sets of the same size that the data do not tell from the best; `plain`: by white residuals, as nothing passes."""
    size = len(best.hypothesis.mechanisms)
    rivals = [
        one.hypothesis
        for ranking in tried
        for one in ranking
        if len(one.hypothesis.mechanisms) == size and one.hypothesis is not best.hypothesis
    ]

    def bic(one: Hypothesis) -> float:
        return plain_bic(problem, one) if plain else whitened_bic(problem, one, best.noise)

    most = bic(best.hypothesis) + EQUIVALENT
    return tuple(one for one in rivals if one.cost < NEAR * best.hypothesis.cost and bic(one) < most)
