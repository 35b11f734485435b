"""Stepwise search: forward selection of mechanisms, residual tests as acceptance, backward elimination.

A larger set is tried only where no smaller one passes. Up to two causes, several sets of one size are extended; larger
sets grow one at a time, because a real device is never exactly the model and then no set passes: by a cause that takes
enough of the squared residual (`SearchThresholds.stall_shares`), or by a small third one where two leave far more than
the noise; by two at once where no single one takes enough. While nothing passes, sets are ranked by plain cost: the
noise is not known then, and a filter that whitens a misfit hides it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rtctl.diagnosis.nominal_fit.step_refinement import refine_steps
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.noise_floor import residual_over_noise
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, project_plainly, run_residual_tests
from rtctl.diagnosis.search.challengers import list_unfinished, refit_challengers, refit_rivals
from rtctl.diagnosis.search.elimination.backward_elimination import (
    drop_causes_within_allowance,
    drop_inactive_causes,
    drop_negligible_causes,
    refit_smaller_sets,
    refit_without,
    refit_without_each,
)
from rtctl.diagnosis.search.elimination.general_laws import fit_general_laws
from rtctl.diagnosis.search.elimination.simpler_laws import (
    prefer_fewest_unknowns,
    prefer_simpler_laws,
)
from rtctl.diagnosis.search.leaders import (
    find_almost_passing,
    find_leaders,
    find_passing_tie,
    refit_leaders_from_segments,
)
from rtctl.diagnosis.search.model_selection import (
    best_of_each_set,
    rank_hypotheses,
    whitened_bic,
)
from rtctl.diagnosis.search.outcome import SearchResult, find_equivalents, replace_chosen
from rtctl.diagnosis.search.proposals.candidates import interleave, propose_candidates, propose_pairs
from rtctl.diagnosis.search.proposals.regression import propose_by_regression
from rtctl.diagnosis.search.state import SearchSettings, SearchState, StopReason
from rtctl.diagnosis.search.successive_halving import Candidate, halve_successively


def search_stepwise(problem: Problem, nominal: Hypothesis, settings: SearchSettings) -> SearchResult:
    """Search the sets of mechanisms that explain what the fitted nominal model leaves.

    Args:
        problem: Records to fit.
        nominal: Nominal model, fitted to these records.
        settings: Mechanisms, significance level, budget and callbacks.

    Returns:
        The smallest set that passes the residual tests, else the best set found.

    Raises:
        CancelledError: Between two fits, once the problem's cancellation token is set.
    """
    state = start_search(problem, nominal, settings)
    while state.stop is None:
        state = select_forward(state)
        lower = find_lower_nominal(state)
        state = assess_sets(state) if lower is None else start_search(problem, lower, settings)
    return conclude_search(state)


def significance_level(problem: Problem, false_claim_rate: float) -> float:
    """Return the significance level of the residual tests for a rate of false claims."""
    return problem.thresholds.search.significance_share * false_claim_rate


def start_search(problem: Problem, nominal: Hypothesis, settings: SearchSettings) -> SearchState:
    """Test the nominal model; the search ends here if it passes."""
    tested = run_residual_tests(nominal, problem, settings.ids)
    passes = settings.passes(tested)
    result = SearchResult(tested, tested, passes, (), ())
    settings.keep(result)
    return SearchState(
        settings=settings, given=problem, problem=problem, nominal=tested, best=tested, smaller=tested,
        parents=(tested,), stop=StopReason.PASSED if passes else None, result=result if passes else None,
    )  # fmt: skip


def select_forward(state: SearchState) -> SearchState:
    """Extend the parents by each further mechanism and fit the extended sets by successive halving."""
    size = state.size + 1
    if size > state.limits.largest_set:
        return replace(state, stop=StopReason.LARGEST_SET)
    parents = state.parents if size <= state.limits.beam_size else (state.best,)
    groups: list[Sequence[Candidate]] = [propose_candidates(parent, state.limits) for parent in parents]
    if size == 1:
        state = replace(state, regressed=propose_by_regression(state.nominal, state.problem))
        judged = state.regressed.judged
        others = ([one for one in group if judged.isdisjoint(one.mechanisms)] for group in groups)
        groups = [state.regressed.singles, *others]
    if size == 2:
        groups = [*_propose_two(state, state.nominal), *groups]
    fits = halve_successively(state.problem, interleave(groups), state.settings.report, state.settings.budget)
    if not fits:
        return replace(state, stop=StopReason.NO_CANDIDATES)
    return replace(state, size=size, parents=parents, fits=tuple(fits))


def _propose_two(state: SearchState, parent: TestedHypothesis) -> list[Sequence[Candidate]]:
    """Return the parent's set with two further mechanisms at once: by the measured motion, and by its residual."""
    measured = state.regressed.pairs if parent is state.nominal else ()
    return [measured, propose_pairs(parent, state.limits)]


def find_lower_nominal(state: SearchState) -> Hypothesis | None:
    """Return the nominal model refitted from the best single cause, if it had been stuck in a local minimum.

    It had been if it starts there below its former cost and ends far below: then the cause is only a way around.
    """
    if state.size != 1 or state.stop is not None:
        return None
    nominal = state.nominal.hypothesis
    lower = refit_without(state.problem, nominal, state.fits[0], nominal.mechanisms, below=nominal.cost)
    return lower if lower is not None and lower.cost < state.limits.stuck_share * nominal.cost else None


def assess_sets(state: SearchState) -> SearchState:
    """Select, test and accept or reject the fitted sets of one size."""
    for step in (
        refit_leader_challengers,
        select_best,
        refine_integration_steps,
        keep_sufficient_smaller_set,
        rank_sets,
        accept_passing_set,
        correct_identified_model,
        stop_without_progress,
    ):
        if state.stop is not None:
            break
        state = step(state)
    return state


def refit_leader_challengers(state: SearchState) -> SearchState:
    """Refit sets that a lone leader leaves far behind, from where the leader ended."""
    return replace(
        state, fits=tuple(refit_challengers(state.problem, state.parents, state.fits, state.settings))
    )


def select_best(state: SearchState) -> SearchState:
    """Select the best set of this size, and those that are extended if it does not pass.

    Returns:
        The state with the passing set of the largest p-value as `best`, else one that almost passes, else the lowest
        cost; `parents` are the tested sets.
    """
    leaders = find_leaders(state)
    if not any(state.settings.passes(one) for one in leaders) and not state.out_of_work:
        leaders = refit_leaders_from_segments(state, leaders)
    passing = [one for one in leaders if state.settings.passes(one)]
    if passing:
        best = max(passing, key=lambda one: one.p_value)
        return replace(state, smaller=state.best, best=best, parents=tuple(leaders))
    tied = find_passing_tie(state, leaders)
    if tied is not None:
        return replace(state, smaller=state.best, best=tied, parents=(*leaders, tied))
    best = find_almost_passing(leaders, state.limits.almost_passing_p) or leaders[0]
    return replace(state, smaller=state.best, best=best, parents=tuple(leaders[: state.limits.beam_width]))


def refine_integration_steps(state: SearchState) -> SearchState:
    """Refine the integration steps where their error is a visible part of what the best set leaves."""
    if state.settings.passes(state.best) or state.out_of_work:
        return state
    finer, refitted = refine_steps(state.problem.until(state.settings.budget), state.best.hypothesis)
    if finer.steps_per_period == state.problem.steps_per_period:
        return state
    state = replace(state, problem=replace(state.problem, steps_per_period=finer.steps_per_period))
    best = state.test(refitted)
    others = (one for one in state.parents if one.hypothesis.mechanisms != refitted.mechanisms)
    return replace(state, best=best, parents=(best, *others))


def keep_sufficient_smaller_set(state: SearchState) -> SearchState:
    """Accept the smaller set where the larger one passes but is not worth its parameters.

    What the residual tests found in the smaller set may then be chance.
    """
    if not state.settings.passes(state.best):
        return state
    smaller, larger = (
        whitened_bic(state.problem, one.hypothesis, state.best.noise) for one in (state.smaller, state.best)
    )
    if smaller - larger > state.limits.needed_bic:
        return state
    tried = rank_sets(state).rankings
    result = refit_smaller_sets(state.problem, state.result_with(state.smaller, passes=True), state.settings)
    state = accept_set(state, refit_rivals(state.problem, result, state.smaller, state.settings))
    assert state.result is not None
    ranked = state.result.rankings  # the sets that were not needed were tried all the same
    return replace(state, result=state.result._replace(rankings=(*ranked, *tried[len(ranked) :])))


def rank_sets(state: SearchState) -> SearchState:
    """Rank the sets of this size, and keep what is known so far."""
    fits = best_of_each_set([*(one.hypothesis for one in state.parents), *state.fits])
    plain = not state.settings.passes(state.best)
    ranking = rank_hypotheses(state.problem, fits, state.best, plain=plain)
    state = replace(state, rankings=(*state.rankings, ranking))
    state.settings.keep(state.result_with(state.best, passes=False))
    return state


def accept_passing_set(state: SearchState) -> SearchState:
    """Accept the best set if it passes, or a smaller one that passes once it is refitted from there."""
    passes = state.settings.passes(state.best)
    result = state.result_with(state.best, passes=True)
    if passes or not state.out_of_work:
        result = refit_smaller_sets(state.problem, result, state.settings, larger_passes=passes)
    if not passes and result.chosen is state.best:
        return state
    result = drop_inactive_causes(state.problem, result, state.settings.ids)
    result = drop_causes_within_allowance(state.problem, result, state.settings.ids)
    return accept_set(state, refit_rivals(state.problem, result, state.best, state.settings))


def accept_set(state: SearchState, result: SearchResult) -> SearchState:
    """End the search with the set that `result` has chosen, in its simplest laws, beside its equivalents."""
    result = prefer_simpler_laws(state.problem, result, state.settings)
    result = prefer_fewest_unknowns(state.problem, result, state.settings)
    result = drop_inactive_causes(state.problem, result, state.settings.ids)
    return replace(state, stop=StopReason.PASSED, result=_with_equivalents(state, result, plain=False))


def correct_identified_model(state: SearchState) -> SearchState:
    """Correct the identified part of the model behind two causes that do not pass; accept them if they then pass.

    It comes before a third cause, which would only explain the errors of that part.
    """
    correct = state.settings.correct_model
    tried = "one cause does not" if state.size == 1 else f"{state.size} causes do not"
    state.settings.report(f"{tried} explain it")
    state.problem.cancellation.raise_if_cancelled()
    if correct is None or state.size != state.limits.beam_size or state.out_of_work:
        return state
    corrected = correct(state.result_with(state.best, passes=False))
    if corrected is not None and corrected.passes:
        return replace(state, stop=StopReason.PASSED, result=corrected)
    return replace(state, correction=corrected)


def stop_without_progress(state: SearchState) -> SearchState:
    """End the search where the larger set removes too little, or the budget is spent.

    Two more causes may do together what neither does alone: before the search stalls, pairs are tried beside the
    smaller set.
    """
    smaller, larger = state.smaller.hypothesis.cost, state.best.hypothesis.cost
    if larger > stall_share(state) * smaller:
        jumped = _add_two_at_once(state)
        if jumped is not None:
            return assess_sets(jumped)
        partial = larger < state.limits.partial_share * smaller
        return replace(state, stop=StopReason.STALLED, best=state.best if partial else state.smaller)
    return replace(state, stop=StopReason.OUT_OF_WORK) if state.out_of_work else state


def _add_two_at_once(state: SearchState) -> SearchState | None:
    """Return the state with the smaller set and two causes more, fitted; None where that is not far better either.

    Pairs are those that promise most beside the noise, and by plain squares: a drift is slow noise to a filter that
    whitens the residual, and no pair with it is proposed by that; but plain squares keep a quadratic spring, whose mean
    the drift takes up, from its size, and only both together leave less.
    """
    size, limits = state.size + 1, state.limits
    if size > limits.largest_set or state.out_of_work:
        return None
    plain = project_plainly(state.smaller, state.problem, state.settings.ids)
    pairs = interleave([*_propose_two(state, state.smaller), propose_pairs(plain, limits)])
    fits = halve_successively(state.problem, pairs, state.settings.report, state.settings.budget)
    if not fits:
        return None
    far_better = fits[0].cost <= limits.stall_shares[-1] * state.smaller.hypothesis.cost
    if not far_better and not state.settings.passes(state.test(fits[0])):
        return None
    return replace(state, size=size, best=state.smaller, parents=(state.smaller,), fits=tuple(fits))


def stall_share(state: SearchState) -> float:
    """Return the share of the smaller set's cost above which a set of the present size ends the search."""
    limits = state.limits
    if (
        state.size == limits.small_cause_size
        and residual_over_noise(state.smaller) > limits.small_cause_excess
    ):
        return limits.small_cause_share
    return limits.stall_shares[min(state.size, len(limits.stall_shares)) - 1]


def conclude_search(state: SearchState) -> SearchResult:
    """Return the accepted set, or the best one without its negligible causes where none was accepted."""
    for last in (_generalise_best, _follow_tests_of_best):
        state = state if state.result is not None else last(state)
    result = state.result
    if result is None:
        result = state.result_with(state.best, passes=False)
        result = drop_negligible_causes(state.problem, result, state.settings)
        result = prefer_simpler_laws(state.problem, result, state.settings)
        result = _with_equivalents(state, result, plain=not result.passes)
    if state.out_of_work and not result.passes:
        result = result._replace(out_of_time=True)
        result = result._replace(equivalent=list_unfinished(state.problem, result))
    if result.hysteresis_refit is not None:
        return result
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    problem = result.refined_problem or state.given
    return result._replace(leave_one_out=refit_without_each(problem, nominal, chosen, result.hypotheses))


def _generalise_best(state: SearchState) -> SearchState:
    """Return the state with a more general law in place of one of the best set's, where that leaves less; accept it.

    A set that passes is accepted. The simpler law comes back where the data do not need the other.
    """
    best, result = state.best, state.result_with(state.best, passes=False)
    fits = fit_general_laws(state.problem, state.nominal.hypothesis, best.hypothesis, state.settings)
    if not fits or fits[0].cost >= best.hypothesis.cost:
        return state
    general = state.test(fits[0])
    result = replace_chosen(state.problem, result, general)
    state = replace(state, best=general, rankings=result.rankings)
    return accept_set(state, result._replace(passes=True)) if state.settings.passes(general) else state


def _follow_tests_of_best(state: SearchState) -> SearchState:
    """Return the state with the cause beside the best set's that its tests point to; accept that where it passes.

    A cause may have stood in for another (a softening cubic spring for a quadratic one), whose own fit stopped in a
    local minimum and for whose larger set no work was left. Beside the other it finds its size, and the one that stood
    in falls out (the exchange of floating selection: Pudil, Novovicova, Kittler, Pattern Recogn. Lett. 15 (1994) 1119).
    """
    limits, best = state.limits, state.best
    if best is state.nominal or state.problem.allowed or state.correction is not None:
        return state
    work = state.problem.thresholds.budget.followed
    settings = replace(state.settings, budget=state.settings.budget.further(work))
    candidates = propose_candidates(best, limits, least=limits.followed_score)
    fits = halve_successively(state.problem, candidates[: limits.followed], settings.report, settings.budget)
    if not fits or fits[0].cost > limits.followed_cost * best.hypothesis.cost:
        return state
    larger = state.test(fits[0])
    if not settings.passes(larger):
        return state
    followed = replace(
        state,
        settings=settings,
        size=state.size + 1,
        smaller=best,
        best=larger,
        parents=(larger,),
        fits=tuple(fits),
    )
    return accept_passing_set(rank_sets(followed))


def _with_equivalents(state: SearchState, result: SearchResult, *, plain: bool) -> SearchResult:
    same = find_equivalents(state.problem, result.rankings, result.chosen, plain=plain)
    refined = None if state.problem is state.given else state.problem
    return result._replace(equivalent=same, refined_problem=refined)
