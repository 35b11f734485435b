"""What a search returns, and the verdict that it alone supports: test records may lower it later."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.model_selection import RankedHypothesis

NEARLY = 1e-6
"""Of the gate: what is left beyond a set of a larger p-value is little, whatever it is."""
LEAST_GAIN = 1.5
"""Times less error on records that no fit saw: a part that is explained and gains less there, or by chance, is not
named."""
HALF = 1.0 - 1.0 / LEAST_GAIN**2
"""Of the squares: what the least gain on test records comes to."""


class HysteresisRefit(NamedTuple):
    """A static part that was learned anew."""

    coarse: Mapping[str, Any]
    """By output, what showed it."""
    loops: Mapping[str, Any]
    """By output, the part itself."""
    before: Hypothesis
    """The same causes with the part as it was."""

    @property
    def is_cause(self) -> bool:
        """Whether the identification's own records show it; else the part is only put right."""
        return any(one.is_coarse for one in self.coarse.values())


class SearchResult(NamedTuple):
    """What came of it."""

    nominal: TestedHypothesis
    chosen: TestedHypothesis
    """The smallest set that passes, else the best of the largest size."""
    passes: bool
    equivalent: tuple[Hypothesis, ...]
    """Others of its size that these data explain as well."""
    rankings: tuple[tuple[RankedHypothesis, ...], ...]
    """By size, best first."""
    leave_one_out: tuple[Hypothesis, ...] = ()
    """The chosen set less each one of its causes, fitted again."""
    out_of_time: bool = False
    """Larger sets, or some of this size, were not looked at."""
    hysteresis_refit: HysteresisRefit | None = None
    """What was identified of the model and then learned anew; `chosen` has it, `nominal` has not."""
    better_alternative: str | None = None
    """What a law of no name that leaves less does, "" where none leaves less; None: not compared."""
    refined_problem: Problem | None = None
    """What was searched with steps as fine as the causes need; None: as asked."""

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """Every set that was."""
        return [one.hypothesis for ranking in self.rankings for one in ranking]


def classify_outcome(search: SearchResult, least_removed: float) -> str:
    """By the gate; where nothing passes, by whether the best set removes `least_removed` of the squared misfit, or
    more than half of it and all but passes: noise is never quite the one that the gate assumes.
    """
    if search.passes:
        return "adequate" if search.chosen.hypothesis is search.nominal.hypothesis else "explained"
    nominal, best = search.nominal.hypothesis.cost, search.chosen.hypothesis.cost
    least = min(least_removed, HALF) if search.chosen.p_value > NEARLY else least_removed
    return "partly_explained" if best < (1.0 - least) * nominal else "unexplained"
