"""What a search for causes is asked, with the options of the user, and what it found."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rtctl.border.errors import InputError
from rtctl.border.options import check_number
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.static_loops.hysteresis_refit import LoopRefitter
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.diagnosis.thresholds import BudgetThresholds, Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.measured.dataset import Dataset


@dataclass(frozen=True, slots=True, kw_only=True)
class DiagnosisOptions:
    """Options of a diagnosis."""

    false_claim_rate: float = 0.05
    """Share of devices with nothing hidden to which a cause may be given."""
    threads: int = max(1, min(2, os.cpu_count() or 1))
    """Number of threads that simulate records."""
    work: float = field(default_factory=lambda: BudgetThresholds().search)
    """Simulated steps after which no further fit begins."""
    seconds: float = math.inf
    """Outer guard of wall-clock time [s]; an answer that it cut says so."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    """Numbers that decide in a diagnosis."""
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
    """What a search for causes needs."""

    problem: Problem
    """Records to fit."""
    nominal: Hypothesis
    """Nominal model, fitted to them."""
    model: Any
    """Model of the file, of the subject's kind."""
    dataset: Dataset
    """All records, with those of the identification."""
    tests: tuple[FitRecord, ...]
    """Records that take no part in a fit."""
    ids: Sequence[str]
    """Mechanisms of the catalogue that are searched."""
    options: DiagnosisOptions
    """Options of the user."""
    budget: WorkBudget
    """Work of the diagnosis."""
    report: Callable[[str], None]
    """Called with what is under way."""

    def loop_refitter(self, loops: Mapping[str, Any]) -> LoopRefitter:
        """Return what a refit of these static loops (by output) needs."""
        return LoopRefitter(
            coarse=loops, problem=self.problem, tests=self.tests, ids=self.ids, report=self.report,
            level=significance_level(self.problem, self.options.false_claim_rate), budget=self.budget,
        )  # fmt: skip


class FoundCauses(NamedTuple):
    """Outcome of a search for causes."""

    result: SearchResult
    notes: list[str]
    """What is said of it in the answer."""
    cancelled: bool
    """Whether the user stopped it."""
    behind_refitted_loops: bool = False
    """Whether the catalogue was searched with refitted loops too."""
    course: str = ""
    """What is said of test records whose free runs take another course."""
    tests: tuple[FitRecord, ...] = ()
    """Test records by which it was judged."""
