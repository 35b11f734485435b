"""Leaders among the fitted sets of one size: tested, refitted from segments, ordered by them."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.nominal_fit.misfit.segment_misfit import segment_cost, sort_by_segments
from rtctl.diagnosis.nominal_fit.whole_record_start import refit_from_segments
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.challengers import refit_challengers
from rtctl.diagnosis.search.model_selection import select_likeliest
from rtctl.diagnosis.search.state import SearchState


def find_leaders(state: SearchState) -> list[TestedHypothesis]:
    """Test the set of the lowest cost and the likeliest one, with coloured noise of its own."""
    first = state.fits[0]
    likely = select_likeliest(state.problem, state.fits[: state.limits.beam_width])
    return [state.test(one) for one in ([first] if likely is first else [first, likely])]


def refit_leaders_from_segments(
    state: SearchState, tested: Sequence[TestedHypothesis]
) -> list[TestedHypothesis]:
    """Refit the best sets from short segments, and test them in the order of their cost over segments.

    The best are those of the lowest cost, and where no set is near the readings also those that fit segments best.
    """
    limits, fits = state.limits, state.fits
    near = limits.beam_cost if state.size < limits.beam_size else limits.similar_cost
    best = [one for one in fits[: limits.beam_width] if one.cost < near * fits[0].cost]
    problem, count = state.problem.until(state.settings.budget), limits.segment_refits
    first = best[:count]
    if relative_misfit(problem, fits[0]) >= problem.thresholds.nominal_fit.close_misfit:
        nearest = sort_by_segments(problem, fits[: limits.sets_over_segments])[:count]
        first += [one for one in nearest if not any(one is other for other in best[:count])]
    rest = [one for one in best if not any(one is other for other in first)]
    refitted = [*(refit_from_segments(problem, one) for one in first), *rest]
    refitted.sort(key=lambda one: one.cost)
    field = refit_challengers(state.problem, state.parents, refitted, state.settings)
    ordered = order_by_segments(state.problem, [one for one in field if one.cost < near * field[0].cost])
    known = {id(one.hypothesis): one for one in tested}
    return [known.get(id(one)) or state.test(one) for one in ordered]


def find_passing_tie(state: SearchState, tested: Sequence[TestedHypothesis]) -> TestedHypothesis | None:
    """Return the first set that passes among those as good as the leader by cost."""
    limits, lowest = state.limits, state.fits[0].cost
    seen = {id(one.hypothesis) for one in tested}
    for one in state.fits[: limits.tied_sets]:
        if one.cost < limits.tied_cost * lowest and id(one) not in seen and not state.out_of_work:
            further = state.test(one)
            if state.settings.passes(further):
                return further
    return None


def find_almost_passing(tested: Sequence[TestedHypothesis], least: float) -> TestedHypothesis | None:
    """Return the set of the largest p-value if that is above `least` and the first one's is not.

    Kinks keep a fit from its minimum, and the residual tests see how near it is.
    """
    nearest = max(tested, key=lambda one: one.p_value)
    return nearest if nearest.p_value > least >= tested[0].p_value else None


def order_by_segments(problem: Problem, field: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return `field`, those about as good as the first in the order of their cost over short segments."""
    close = [one for one in field if one.cost < problem.thresholds.search.similar_cost * field[0].cost]
    if len(close) > 1:
        costs = {id(one): segment_cost(problem, one) for one in close}
        close.sort(key=lambda one: costs[id(one)])
    return [*close, *field[len(close) :]]
