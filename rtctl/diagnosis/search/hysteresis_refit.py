"""What was identified of a model, found too coarse: learned anew, finer, where that holds on records no fit saw.

The identification's own records say whether its static part is too coarse, whatever else acts on the others. If they
do, the causes found so far keep their place, that part is learned behind them from the fitted records too, and it is a
cause if the error on test records falls by it: noise, and causes that it could imitate, do not repeat there. Where
those records say nothing, but causes leave more than the noise, it is learned anew behind them all the same, and put
right where that helps there: what lies between the levels of a staircase was never measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subject import Placed
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.backward_elimination import NEGLIGIBLE, refit_without, refit_without_each
from rtctl.diagnosis.search.holdout_error import compute_free_run_error, gain
from rtctl.diagnosis.search.holdout_support import SMALL
from rtctl.diagnosis.search.outcome import LEAST_GAIN, HysteresisRefit, SearchResult
from rtctl.identification.fit_record import FitRecord

ID = "hysteresis.shape"
WORSE = 0.95
"""Of the error before: no output's on test records may rise to one over it."""
AS_IDENTIFIED = 3.0
"""Times the cost with gains and offsets of their own: a session that was calibrated as the identification was leaves no
more, however far off the loops are between their levels."""


def _silent(text: str) -> None:
    """Nobody listens."""


class LoopRefitter(NamedTuple):
    """What it takes to learn them: read-outs by output, the records, the gate."""

    coarse: Mapping[str, Any]
    problem: Problem
    tests: Sequence[FitRecord]
    ids: Sequence[str]
    level: float
    report: Callable[[str], None] = _silent
    """Called with what is under way."""
    budget: WorkBudget | None = None
    """Of the diagnosis: without end where there is none."""

    def behind(self, found: SearchResult) -> SearchResult:
        """`found` with loops learned anew behind its causes, where test records say that they help; else as it is."""
        nominal = found.nominal.hypothesis
        known = _without_its_correction(self.problem, nominal, found.chosen.hypothesis)
        fewer = _less_what_is_small(self.problem, nominal, known)
        # what is small beside the causes may be the error of the loops
        if fewer is not known and self._lasts(self.problem.thresholds.budget.refit_twice):
            alone = self._behind(found, fewer)
            if alone is not found and alone.passes:
                return alone
        return self._behind(found, known)

    def _behind(self, found: SearchResult, known: Hypothesis) -> SearchResult:
        problem, nominal, chosen = self.problem, found.nominal.hypothesis, found.chosen.hypothesis
        placed, again = self._learned(known)
        if placed is None:
            return found
        bare = fit_hypothesis(
            problem, placed(nominal.simulation), nominal.mechanisms, nominal.starts, still=nominal.still
        )
        if bare is None:
            return found
        again = _less_what_they_replace(problem, bare, again)
        learned = HysteresisRefit(self.coarse, placed.loops, known)
        if not learned.is_cause and again.mechanisms == bare.mechanisms:
            return found
        examined = run_residual_tests(again, problem, self.ids)
        claimed = learned.is_cause or not found.passes  # else any gain will do that is certain
        others = [(chosen, LEAST_GAIN if claimed else 1.0)]
        others += [] if learned.is_cause else [(bare, LEAST_GAIN)]  # the causes have to help by themselves
        if not all(_helps(one, examined, problem, self.tests, least) for one, least in others):
            return found
        return found._replace(
            chosen=examined, passes=examined.p_value > self.level, equivalent=(),
            leave_one_out=refit_without_each(problem, bare, again), hysteresis_refit=learned,
        )  # fmt: skip

    def _lasts(self, steps: float) -> bool:
        return self.budget is None or self.budget.left > steps

    def _learned(self, known: Hypothesis) -> tuple[Placed | None, Hypothesis]:
        """Loops behind `known`, and `known` fitted with them; None where they leave no less.

        Twice, if time lasts: with the first loops the causes are nearer to the truth.
        """
        beginnings = [one for one in (_as_identified(self.problem, known), known) if one is not None]
        learned, after = min(
            (self._once(one, known.still) for one in beginnings), key=lambda one: one[1].cost
        )
        if not after.cost < known.cost:
            return None, known
        if not self._lasts(0.0):
            return learned, after
        again, then = self._once(after, known.still)
        return (again, then) if then.cost < after.cost else (learned, after)

    def _once(self, behind: Hypothesis, still: frozenset[str]) -> tuple[Placed, Hypothesis]:
        """Loops behind `behind`, and that fitted with them, or as it was where that diverges."""
        problem = self.problem
        assert problem.subject.relearned is not None
        placed = problem.subject.relearned(self.coarse, behind, problem, self.report)
        again = fit_hypothesis(
            problem, placed(behind.simulation), behind.mechanisms, behind.starts, still=still
        )
        return placed, again or behind


def _as_identified(problem: Problem, known: Hypothesis) -> Hypothesis | None:
    """`known` with the gains and offsets that the loops were identified with; None where the records need others.

    Left free they make up for what the loops are off by, and then the causes are off that these are learned behind.
    """
    settled = problem.subject.corrections
    values = np.array([settled.get(one.name, one.value) for one in known.simulation.parameters])
    there = known.simulation.with_values(values)
    found = fit_hypothesis(
        problem, there, known.mechanisms, known.starts, still=known.still | frozenset(settled)
    )
    return found if found is not None and found.cost < AS_IDENTIFIED * known.cost else None


def _without_its_correction(problem: Problem, nominal: Hypothesis, chosen: Hypothesis) -> Hypothesis:
    """Less the smooth correction of the loops, which finer ones make needless."""
    rest = tuple(name for name in chosen.mechanisms if name != ID)
    if rest == chosen.mechanisms or ID in nominal.mechanisms:
        return chosen
    if rest == nominal.mechanisms:
        return nominal
    return refit_without(problem, nominal, chosen, rest) or chosen


def _less_what_is_small(problem: Problem, nominal: Hypothesis, known: Hypothesis) -> Hypothesis:
    """Without the causes that remove little of what the set does."""
    removed = nominal.cost - known.cost
    fewer = known
    while len(fewer.mechanisms) > len(nominal.mechanisms) + 1:
        rest = min(refit_without_each(problem, nominal, fewer), key=lambda one: one.cost, default=None)
        if rest is None or rest.cost - known.cost > SMALL * removed:
            break
        fewer = rest
    return fewer


def _less_what_they_replace(problem: Problem, bare: Hypothesis, again: Hypothesis) -> Hypothesis:
    """Without the causes that hardly matter once the loops are finer."""
    while len(again.mechanisms) > len(bare.mechanisms):
        fewer = min(refit_without_each(problem, bare, again), key=lambda one: one.cost, default=None)
        if fewer is None or fewer.cost > NEGLIGIBLE * again.cost:
            break
        again = fewer
    return again


def over_noise(found: TestedHypothesis, tests: Sequence[FitRecord]) -> float:
    """Error on test records (RMS) over what of the noise cannot be predicted, of the output where that is largest; 0
    where none has one.

    The slow part of what is left may be noise or the model's own error, and a noise model takes it for its own.
    """
    simulation, most = found.hypothesis.simulation, 0.0
    for name, noise in zip(found.hypothesis.sensitivity.outputs, found.noise, strict=True):
        errors = [
            compute_free_run_error(simulation, record, name) for record in tests if name in record.measured
        ]
        if errors and noise.variance > 0.0:
            most = max(most, float(np.sqrt(np.mean(np.concatenate(errors) ** 2) / noise.variance)))
    return most


def _helps(
    before: Hypothesis, after: TestedHypothesis, problem: Problem, tests: Sequence[FitRecord], least: float
) -> bool:
    """Whether an output's error on test records beyond the noise falls to one over `least`, and none rises."""
    gains, rate = [], problem.scales.rate
    for name, noise in zip(after.hypothesis.sensitivity.outputs, after.noise, strict=True):
        seen = [record for record in tests if name in record.measured]
        floor = float(np.sqrt(noise.mean_square))
        one = gain(before.simulation, after.hypothesis.simulation, seen, name, "", floor, rate)
        gains += [one] if one is not None else []

    def falls(was: float, now: float, floor: float) -> bool:
        return max(now**2 - floor**2, 0.0) < (was**2 - floor**2) / least**2

    lower = any(one.ratio_low > 1.0 and falls(one.before, one.after, one.noise_floor) for one in gains)
    return lower and all(one.ratio > WORSE for one in gains)
