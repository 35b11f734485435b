"""State of a stepwise search: what each step reads, and returns changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.first_samples import run_search_tests
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.model_selection import RankedHypothesis
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.proposals.regression import NO_REGRESSIONS, Regressions
from rtctl.diagnosis.thresholds import SearchThresholds


def _report_nothing(text: str) -> None:
    pass


def _keep_nothing(result: SearchResult) -> None:
    pass


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """What stays the same during a search."""

    ids: Sequence[str]
    """Mechanisms of the catalogue that are searched."""
    level: float
    """Significance level: a set passes if the p-value of its residual tests is above it."""
    budget: WorkBudget
    """Work after which no further fit begins."""
    report: Callable[[str], None] = _report_nothing
    """Called with a text before each fit."""
    keep: Callable[[SearchResult], None] = _keep_nothing
    """Called with what is known so far after each size, for an answer of a search that is cancelled."""
    correct_model: Callable[[SearchResult], SearchResult | None] | None = None
    """Corrects the identified part of the model behind causes that do not pass; it returns None where it does not try.
    """

    def passes(self, tested: TestedHypothesis) -> bool:
        """Return whether the residual tests accept the hypothesis."""
        return tested.p_value > self.level

    def for_rivals(self) -> SearchSettings:
        """Return the settings with the budget of a refit of rivals, from now on."""
        return replace(self, budget=self.budget.further(self.budget.thresholds.rivals))


class StopReason(Enum):
    """Why a search ended."""

    PASSED = auto()
    """A set passes the residual tests."""
    NO_CANDIDATES = auto()
    """No larger set could be fitted."""
    STALLED = auto()
    """The larger set removes too little."""
    OUT_OF_WORK = auto()
    """The work budget is spent."""
    LARGEST_SET = auto()
    """No larger sets are tried."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchState:
    """Sets of causes of the present size, and the way there."""

    settings: SearchSettings
    given: Problem
    """The problem as the search was started."""
    problem: Problem
    """The same, with finer integration steps where the best set needs them."""
    nominal: TestedHypothesis
    best: TestedHypothesis
    """Best set of the present size; the nominal model at size 0."""
    smaller: TestedHypothesis
    """Best set of the size before."""
    parents: tuple[TestedHypothesis, ...]
    """Sets that are extended next."""
    fits: tuple[Hypothesis, ...] = ()
    """Fits of the present size, lowest cost first."""
    regressed: Regressions = NO_REGRESSIONS
    """Starts from the nominal model by the measured motion."""
    rankings: tuple[tuple[RankedHypothesis, ...], ...] = ()
    """Sets of each size so far, best first."""
    correction: SearchResult | None = None
    """Outcome of the correction of the identified model, once it was tried."""
    size: int = 0
    """Number of causes."""
    stop: StopReason | None = None
    result: SearchResult | None = None
    """The accepted set, once there is one."""

    @property
    def limits(self) -> SearchThresholds:
        """Return the thresholds of the search."""
        return self.problem.thresholds.search

    @property
    def out_of_work(self) -> bool:
        """Return whether no further fit may begin."""
        return self.settings.budget.spent

    def test(self, hypothesis: Hypothesis) -> TestedHypothesis:
        """Run the residual tests on `hypothesis`."""
        return run_search_tests(hypothesis, self.problem, self.settings.ids)

    def result_with(self, chosen: TestedHypothesis, *, passes: bool) -> SearchResult:
        """Return the present rankings with one of their sets chosen."""
        return SearchResult(self.nominal, chosen, passes, (), self.rankings, correction=self.correction)
