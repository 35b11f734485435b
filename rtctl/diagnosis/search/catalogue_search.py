"""What is wrong: a search of the catalogue, finer loops where the identified ones are too coarse."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rtctl.border.errors import InputError
from rtctl.border.options import check_number
from rtctl.diagnosis.problem.cancellation import CancellationToken, CancelledError
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.search.holdout_support import drop_unsupported
from rtctl.diagnosis.search.hysteresis_refit import LoopRefitter, over_noise
from rtctl.diagnosis.search.nonparametric import find_better_alternative
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.diagnosis.search.stepwise import as_it_is, search, significance_level
from rtctl.diagnosis.thresholds import BudgetThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.measured.dataset import Dataset

WORTH_PUTTING_RIGHT = 1.05
"""Times what of the noise cannot be predicted, on test records: a set that passes and leaves less there hardly gains by
other loops."""
STOPPED = (
    "stopped by the user after {} fits: no cause is claimed; residual, place and isolability are of the re-fitted "
    "nominal model"
)
NOT_PUT_RIGHT = "stopped by the user before the static loops were learned anew behind these causes"
LOOPS_STOPPED = "stopped by the user before the static loops were looked at: hysteresis.shape may act as well"
NO_HELP = "{} would be small beside the rest, and does not lower the error on the test records: not named"
OUT_OF_WORK = (
    "the search used up its budget of {:.3g} million simulated steps and reports the best set found by then; further "
    "sets of causes were not tried: a larger budget (--work) tries them"
)
CUT_BY_CLOCK = (
    "the wall-clock guard ended the search after {:.0f} s, before its work budget was used up, so this answer depends "
    "on the speed of the machine; a longer guard (--seconds) avoids that"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DiagnosisOptions:
    """What a user may choose."""

    false_claim_rate: float = 0.05
    threads: int = max(1, min(2, os.cpu_count() or 1))
    work: float = field(default_factory=lambda: BudgetThresholds().search)
    """Simulated steps after which no further fit begins."""
    seconds: float = math.inf
    """Outer guard of wall-clock time [s]; an answer that it cut says so."""
    cancellation: CancellationToken = field(default_factory=CancellationToken)
    """Ends the diagnosis after the fit under way, once it is cancelled."""

    def __post_init__(self) -> None:
        limits = "must be above 0 and below 0.5, such as 0.05"
        rate = check_number("false_claim_rate", self.false_claim_rate, limits)
        if not 0.0 < rate < 0.5:
            raise InputError(f"false_claim_rate {rate:g} {limits}")
        check_number("work", self.work, "must be 0 or more simulated steps, such as 1e9", low=0.0)
        check_number("seconds", self.seconds, "must be 0 or more seconds, such as 1800", low=0.0)


class SearchRequest(NamedTuple):
    """What the causes are looked for in."""

    problem: Problem
    nominal: Hypothesis
    model: Any
    dataset: Dataset
    tests: tuple[FitRecord, ...]
    ids: Sequence[str]
    options: DiagnosisOptions
    budget: WorkBudget
    report: Callable[[str], None]

    def relearning(self, loops: Mapping[str, Any]) -> LoopRefitter:
        """What it takes to learn these loops, by output, anew."""
        level = significance_level(self.options.false_claim_rate)
        return LoopRefitter(loops, self.problem, self.tests, self.ids, level, self.report, self.budget)


def find_causes(ask: SearchRequest, *, whole: bool) -> tuple[SearchResult, list[str], bool]:
    """The causes, what is to be said of them, and whether the user stopped. `whole`: records are fitted whole.

    Where the static loops are too coarse, they are learned anew behind what a first look finds: more causes are
    looked for where that is no help only, since beside loops that are wrong a second cause explains their errors.
    """
    first, said, stopped = None, list[str](), False
    if whole and ask.tests:
        try:
            loops = _finer(ask)
        except CancelledError:
            loops = None
        if loops is not None:
            first, said, stopped = _searched(
                ask._replace(budget=ask.budget.further(ask.budget.thresholds.first_look))
            )
            if stopped:
                return first, said, True
            try:
                found = loops.behind(first)
            except CancelledError:
                return first, [LOOPS_STOPPED], True
            if found.hysteresis_refit:
                return found, [], False
    mended = _Mended(ask, [])
    if first is None or first.out_of_time:
        first, said, stopped = _searched(ask, mended.correct if whole else as_it_is)
    found = first
    if whole and not stopped and found.hysteresis_refit is None:
        problem = found.refined_problem or ask.problem
        found, unsupported = drop_unsupported(found, problem, ask.tests, ask.ids, ask.budget)
        said += [NO_HELP.format(" and ".join(unsupported))] if unsupported else []
        try:
            found = mended.at_last(found)
        except CancelledError:
            return found, [*said, NOT_PUT_RIGHT], True
    return found, said, stopped


class _Mended(NamedTuple):
    """Static loops learned anew behind causes that leave something, passing or not, if test records gain by it."""

    ask: SearchRequest
    tried: list[SearchResult]
    """What came of it so far."""

    def correct(self, found: SearchResult) -> SearchResult:
        """Not where a law of no name leaves less: then the causes are wrong, and loops would hide it."""
        ask, subject = self.ask, self.ask.problem.subject
        partly = classify_outcome(found, subject.least_removed) == "partly_explained"
        if not partly or subject.relearned is None or not ask.tests or ask.budget.spent:
            return found
        loops = subject.identified(ask.model, ask.dataset)
        if not loops:
            return found
        law = find_better_alternative(
            ask.problem, found.nominal.hypothesis, found.chosen.hypothesis, ask.budget, ask.report
        )
        found = found._replace(better_alternative=law)
        if not law:
            found = ask.relearning(loops).behind(found)
        self.tried.append(found)
        return found

    def at_last(self, found: SearchResult) -> SearchResult:
        """Of a search that has ended: itself if it passes, else what was mended on its way if that leaves less."""
        if found.passes:
            return self._closer(found)
        if not self.tried:
            return self.correct(found)
        last = self.tried[-1]
        if last.chosen.hypothesis is found.chosen.hypothesis:
            return found._replace(better_alternative=last.better_alternative)
        if last.hysteresis_refit is None or last.chosen.hypothesis.cost >= found.chosen.hypothesis.cost:
            return found
        return last._replace(out_of_time=found.out_of_time)

    def _closer(self, found: SearchResult) -> SearchResult:
        """A set that passes, since a model may be off by so much: with loops that are off by less, if it still does
        and test records show that they are. Not where others explain as much: all of them have the same loops.
        """
        ask, subject = self.ask, self.ask.problem.subject
        named = found.chosen.hypothesis is not found.nominal.hypothesis and not found.equivalent
        if not (named and ask.problem.allowed) or subject.relearned is None or ask.budget.spent:
            return found
        if over_noise(found.chosen, ask.tests) < WORTH_PUTTING_RIGHT:
            return found
        loops = subject.identified(ask.model, ask.dataset)
        if not loops:
            return found
        again = ask.relearning(loops).behind(found)
        return again if again.passes else found


def _finer(ask: SearchRequest) -> LoopRefitter | None:
    """None where the static loops are not too coarse."""
    if ask.problem.subject.relearned is None:
        return None
    ask.report("whether the static loops are too coarse")
    ask.problem.cancellation.raise_if_cancelled()
    coarse = ask.problem.subject.coarse(ask.model, ask.dataset)
    return ask.relearning(coarse) if coarse else None


def _searched(
    ask: SearchRequest, correct: Callable[[SearchResult], SearchResult] = as_it_is
) -> tuple[SearchResult, list[str], bool]:
    """The search, or what is known without it; what is to be said of it, and whether the user stopped it."""
    tried: list[str] = []
    known: list[SearchResult] = []

    def noted(text: str) -> None:
        ask.report(text)
        ask.problem.cancellation.raise_if_cancelled()
        tried.append(text)

    try:
        rate = ask.options.false_claim_rate
        found = search(ask.problem, ask.nominal, ask.ids, rate, noted, known.append, ask.budget, correct)
        return found, [_why_it_ended(ask)] if found.out_of_time else [], False
    except CancelledError:
        so_far = known[-1]
        return so_far._replace(chosen=so_far.nominal, equivalent=()), [STOPPED.format(len(tried))], True


def _why_it_ended(ask: SearchRequest) -> str:
    """Return the note of a search that ended before it was through."""
    if ask.budget.cut_by_clock:
        return CUT_BY_CLOCK.format(ask.options.seconds)
    return OUT_OF_WORK.format(1e-6 * ask.options.work)
