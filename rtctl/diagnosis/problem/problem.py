"""The problem of a diagnosis: the records to fit, their scales, and the kind of plant that they were measured on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from rtctl.border.mechanisms import Scales
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.problem.quantization import quantization_step
from rtctl.diagnosis.problem.subject import Subject
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.identification.fit_record import FitRecord


def _never() -> bool:
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """The records that a diagnosis fits, how large their motion is, and on what it runs."""

    subject: Subject
    records: tuple[FitRecord, ...]
    scales: Scales
    executor: Executor | None = None
    steps_per_period: float | None = None
    allowed: Mapping[str, float] = field(default_factory=dict)
    """Of an output, mean square of a misfit that is no gap, since the nominal model never claimed more."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    cancellation: CancellationToken = field(default_factory=CancellationToken)
    """Asked between fits."""
    enough: Callable[[], bool] = _never
    """Asked between the steps of a fit, which then ends where it is."""

    def until(self, budget: WorkBudget) -> Problem:
        """The same, on which a fit ends once `budget` is spent."""
        return replace(self, enough=lambda: budget.spent)

    @property
    def samples(self) -> int:
        """Of all records."""
        return sum(record.samples for record in self.records)

    @property
    def glance(self) -> Problem:
        """The beginnings of its records, so many samples as a first look at each hypothesis takes."""
        most = self.subject.glance_samples
        if most is None or self.samples <= most:
            return self
        each = max(1, most // len(self.records))
        return replace(self, records=tuple(r.truncate(max(each, r.first + each // 2)) for r in self.records))

    def step(self, output: str) -> float:
        """Of the converter that the output was read with; 0 where none can be seen."""
        return _quantization_step(self.records, output)

    def size(self, output: str) -> float:
        """RMS of a measured output over all scored samples, about its mean where the subject has it so; 1 if zero."""
        values = np.concatenate([record.measured[output][record.first :] for record in self.records])
        return float(values.std() if self.subject.about_mean else np.sqrt(np.mean(values**2))) or 1.0


@lru_cache(maxsize=8)
def _quantization_step(records: tuple[FitRecord, ...], output: str) -> float:
    return quantization_step([record.measured[output] for record in records])
