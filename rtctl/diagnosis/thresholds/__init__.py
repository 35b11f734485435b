"""Every number that decides in a diagnosis: one frozen record a stage, injectable through `Problem.thresholds`.

A test or a study changes one with `dataclasses.replace`; nothing patches a module.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from rtctl.diagnosis.thresholds.budget import BudgetThresholds
from rtctl.diagnosis.thresholds.experiment import ExperimentThresholds
from rtctl.diagnosis.thresholds.nominal_fit import NominalFitThresholds
from rtctl.diagnosis.thresholds.problem import ProblemThresholds
from rtctl.diagnosis.thresholds.report import ReportThresholds
from rtctl.diagnosis.thresholds.residual import ResidualThresholds
from rtctl.diagnosis.thresholds.screening import ScreeningThresholds
from rtctl.diagnosis.thresholds.search import SearchThresholds
from rtctl.diagnosis.thresholds.verification import VerificationThresholds

__all__ = [
    "BudgetThresholds",
    "ExperimentThresholds",
    "NominalFitThresholds",
    "ProblemThresholds",
    "ReportThresholds",
    "ResidualThresholds",
    "ScreeningThresholds",
    "SearchThresholds",
    "Thresholds",
    "VerificationThresholds",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """All thresholds of a diagnosis, by stage."""

    budget: BudgetThresholds = field(default_factory=BudgetThresholds)
    problem: ProblemThresholds = field(default_factory=ProblemThresholds)
    screening: ScreeningThresholds = field(default_factory=ScreeningThresholds)
    nominal_fit: NominalFitThresholds = field(default_factory=NominalFitThresholds)
    residual: ResidualThresholds = field(default_factory=ResidualThresholds)
    search: SearchThresholds = field(default_factory=SearchThresholds)
    verification: VerificationThresholds = field(default_factory=VerificationThresholds)
    experiment: ExperimentThresholds = field(default_factory=ExperimentThresholds)
    report: ReportThresholds = field(default_factory=ReportThresholds)
