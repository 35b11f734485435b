"""What a search returns, and the verdict that it alone supports: test records may lower it later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.model_selection import (
    RankedHypothesis,
    best_of_each_set,
    plain_bic,
    rank_hypotheses,
    whitened_bic,
)
from rtctl.diagnosis.thresholds import SearchThresholds


class HysteresisRefit(NamedTuple):
    """The static hysteresis of the model, refitted behind a set of causes."""

    coarse: Mapping[str, Any]
    """Read-outs of the identification's records, by output."""
    loops: Mapping[str, Any]
    """The refitted static hysteresis, by output."""
    before: Hypothesis
    """The same causes with the static hysteresis as it was identified."""

    @property
    def is_cause(self) -> bool:
        """Return whether the identification's own records show the misfit; else it is a mere correction."""
        return any(one.is_coarse for one in self.coarse.values())


class SearchResult(NamedTuple):
    """Outcome of a search: the chosen set of causes, its rivals, and all sets that were fitted."""

    nominal: TestedHypothesis
    """The nominal model, refitted."""
    chosen: TestedHypothesis
    """The smallest set that passes the residual tests, else the best set found."""
    passes: bool
    """Whether the chosen set passes."""
    equivalent: tuple[Hypothesis, ...]
    """Other sets of its size that the data do not tell from it."""
    rankings: tuple[tuple[RankedHypothesis, ...], ...]
    """Fitted sets by size, best first."""
    leave_one_out: tuple[Hypothesis, ...] = ()
    """The chosen set without each of its causes, refitted."""
    out_of_time: bool = False
    """Whether larger sets, or some of this size, were not tried."""
    hysteresis_refit: HysteresisRefit | None = None
    """The refitted static hysteresis, which `chosen` has and `nominal` has not; None: as identified."""
    better_alternative: str | None = None
    """Sentence of a nonparametric alternative that explains more; "": none does; None: not compared."""
    refined_problem: Problem | None = None
    """The problem with the finer integration steps that the causes need; None: as given."""

    correction: SearchResult | None = None
    """Outcome with the static hysteresis refitted, as it was tried during the search; None: not tried."""

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """Return every set that was fitted."""
        return [one.hypothesis for ranking in self.rankings for one in ranking]


def classify_outcome(result: SearchResult, least_removed: float, limits: SearchThresholds) -> str:
    """Return "adequate", "explained", "partly_explained" or "unexplained" by the residual tests.

    Where no set passes, the best one is a part of the explanation if it removes enough of the squared misfit.

    Args:
        result: Outcome of the search.
        least_removed: Share of the nominal model's squared misfit that a part has to remove.
        limits: Thresholds of the search; a set that almost passes has to remove a little more than half.
    """
    if result.passes:
        return "adequate" if result.chosen.hypothesis is result.nominal.hypothesis else "explained"
    nominal, best = result.nominal.hypothesis.cost, result.chosen.hypothesis.cost
    almost = result.chosen.p_value > limits.almost_passing_p
    least = min(least_removed, limits.removed_share) if almost else least_removed
    return "partly_explained" if best < (1.0 - least) * nominal else "unexplained"


def replace_chosen(problem: Problem, result: SearchResult, fewer: TestedHypothesis) -> SearchResult:
    """Choose the smaller set `fewer`, and rank it among the sets of its size."""
    size = len(fewer.hypothesis.mechanisms) - len(result.nominal.hypothesis.mechanisms)
    known = [one.hypothesis for one in result.rankings[size - 1]]
    fits = best_of_each_set([fewer.hypothesis, *known])
    ranking = rank_hypotheses(problem, fits, fewer, plain=not result.passes)
    return result._replace(
        chosen=fewer, rankings=(*result.rankings[: size - 1], ranking, *result.rankings[size:])
    )


def _generalises(rival: Hypothesis, chosen: Hypothesis) -> bool:
    """Return whether `rival` has in place of one of the chosen causes the same law with further parameters."""
    own, other = (
        set(chosen.mechanisms) - set(rival.mechanisms),
        set(rival.mechanisms) - set(chosen.mechanisms),
    )
    laws = [one for one in rival.simulation.mechanisms if one.id in other]
    return len(own) == len(laws) == 1 and bool(own & set(laws[0].generalises))


def find_equivalents(
    problem: Problem,
    rankings: Sequence[Sequence[RankedHypothesis]],
    best: TestedHypothesis,
    *,
    plain: bool = False,
) -> tuple[Hypothesis, ...]:
    """Return the sets of the best one's size that the data do not tell from it.

    A set whose law has the chosen one as a special case is none of them.

    Args:
        problem: Records that were fitted.
        rankings: Fitted sets, by size.
        best: The chosen set.
        plain: Whether BIC is that of white residuals, since no set passes; else that in the best set's noise.
    """
    limits = problem.thresholds.search
    size = len(best.hypothesis.mechanisms)
    rivals = [
        one.hypothesis
        for ranking in rankings
        for one in ranking
        if len(one.hypothesis.mechanisms) == size
        and one.hypothesis is not best.hypothesis
        and not _generalises(one.hypothesis, best.hypothesis)
    ]

    def bic(one: Hypothesis) -> float:
        return plain_bic(problem, one) if plain else whitened_bic(problem, one, best.noise)

    most = bic(best.hypothesis) + limits.equivalent_bic
    near = limits.equivalent_cost * best.hypothesis.cost
    return tuple(one for one in rivals if one.cost < near and bic(one) < most)
