"""A single cause beside a correction of the static loops, where the loops' own error hides it.

A model that was identified from staircases may be off by more than an effect does, and then the residual tests are
content, or say no more than that something is missing. An error of the loops goes with the place in the loop; with the
loops corrected at the same time, a cause that acts otherwise lowers the error of free runs on test records, which a law
that only takes up a part of the loops' error does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.elimination.holdout_support import is_told_apart
from rtctl.diagnosis.search.holdout_error import Gain, measure_gains
from rtctl.diagnosis.search.model_selection import rank_hypotheses
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.successive_halving import halve_successively
from rtctl.identification.fit_record import FitRecord


class BesideCorrection(NamedTuple):
    """What a search beside a correction of the loops needs."""

    correction: str
    """Mechanism of the catalogue that corrects the loops."""
    problem: Problem
    tests: Sequence[FitRecord]
    ids: Sequence[str]
    level: float
    """Significance level of the residual tests."""
    budget: WorkBudget
    report: Callable[[str], None]

    def search(self, result: SearchResult) -> SearchResult | None:
        """Return the outcome with a cause beside the correction; None where the test records bear out none."""
        limits = self.problem.thresholds.search
        starts = [
            one for one in propose_candidates(result.nominal, limits) if one.mechanisms[-1] == self.correction
        ]
        corrected = halve_successively(self.problem, starts, self.report, self.budget)
        if not corrected:
            return None
        tested = run_residual_tests(corrected[0], self.problem, self.ids)
        fits = halve_successively(self.problem, propose_candidates(tested, limits), self.report, self.budget)
        gains = [(one, self._gains(tested, one)) for one in fits]
        supported = [(fit, found) for fit, found in gains if self._is_supported(found)]
        if not supported:
            return None
        best, _ = max(supported, key=lambda pair: sum(math.log(one.ratio) for one in pair[1]))
        chosen = tested._replace(hypothesis=best)
        rivals = [
            one
            for one, _ in supported
            if one is not best and not is_told_apart(chosen, one, self.problem, self.tests)
        ]
        return self._outcome(result, corrected[0], fits, best, rivals)

    def _outcome(
        self, result: SearchResult, corrected: Hypothesis, fits: Sequence[Hypothesis], best: Hypothesis,
        rivals: Sequence[Hypothesis],
    ) -> SearchResult:  # fmt: skip
        chosen = run_residual_tests(best, self.problem, self.ids)
        passes = chosen.p_value > self.level
        rankings = tuple(
            rank_hypotheses(self.problem, one, chosen, plain=not passes) for one in ([corrected], fits)
        )
        return result._replace(
            chosen=chosen, passes=passes, is_part=not passes, equivalent=tuple(rivals), rankings=rankings,
            leave_one_out=(corrected,),
        )  # fmt: skip

    def _is_supported(self, gains: Sequence[Gain]) -> bool:
        """Return whether the error of an output on test records certainly falls, and that of none rises."""
        limits = self.problem.thresholds.search
        lower = any(one.ratio > limits.least_holdout_gain and one.ratio_low > 1.0 for one in gains)
        return lower and all(one.ratio > limits.rising_error for one in gains)

    def _gains(self, corrected: TestedHypothesis, fit: Hypothesis) -> list[Gain]:
        after = corrected._replace(hypothesis=fit)
        return measure_gains(corrected.hypothesis, after, self.problem, self.tests)
