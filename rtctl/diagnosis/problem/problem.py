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
from rtctl.diagnosis.thresholds import ProblemThresholds, Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.sweep_record import shorten


def _never() -> bool:
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """The records that a diagnosis fits, the sizes of their motion, and the numbers by which it decides."""

    subject: Subject
    """Kind of plant."""
    records: tuple[FitRecord, ...]
    """Records to fit."""
    scales: Scales
    """Sizes of what the records show: displacement, drive, rate of the motion."""
    executor: Executor | None = None
    """Runs the records of a fit in parallel; None: one after the other."""
    steps_per_period: float | None = None
    """Integration steps of the fits in a period of the motion; None: the simulation's own number."""
    allowed: Mapping[str, float] = field(default_factory=dict)
    """Allowed misfit by output, mean square in the output's unit squared: the accuracy that the identification of the
    nominal model claimed. A misfit below it is no gap. Empty: any misfit beyond the noise is one."""
    steps: Mapping[str, float] = field(default_factory=dict)
    """Quantization step of outputs, in their units, where more than these records told it: a part of them may show
    none."""
    taken_off: float = 0.0
    """Share of the residual's squares that noise of the recorded drive made, which is taken off it; 0: none is."""
    thresholds: Thresholds = field(default_factory=Thresholds)
    """Numbers by which the diagnosis decides."""
    cancellation: CancellationToken = field(default_factory=CancellationToken)
    """Request to stop, asked between fits."""
    enough: Callable[[], bool] = _never
    """Called between the iterations of a fit, which ends once it returns True."""

    def until(self, budget: WorkBudget) -> Problem:
        """Return this problem with fits that end once `budget` is spent."""
        return replace(self, enough=lambda: budget.spent)

    def with_steps_of_all(self) -> Problem:
        """Return this problem with the quantization steps that its records tell, for parts of them too."""
        return replace(self, steps={name: self.step(name) for name in sorted(self.measured)})

    @property
    def measured(self) -> set[str]:
        """Outputs that any of the records has."""
        return {name for record in self.records for name in record.measured}

    @property
    def samples(self) -> int:
        """Number of samples of all records."""
        return sum(record.samples for record in self.records)

    @property
    def glance(self) -> Problem:
        """This problem with only the first samples of its records, as many as a first look at a hypothesis needs."""
        most = self.subject.screening_samples
        return self if most is None else self.initial_part(most)

    def initial_part(self, most: int) -> Problem:
        """Return this problem with the first samples of its records, of sweeps chosen rows, about `most` in all."""
        if self.samples <= most:
            return self
        return replace(self, records=_first_samples(self.records, max(1, most // len(self.records))))

    @property
    def rest(self) -> str:
        """Describe what an adequate model leaves."""
        if not self.allowed:
            return "noise"
        shares = (
            f"{np.sqrt(square) / self.size(name):.1%} of the {name.replace('_', ' ')}'s variation"
            for name, square in self.allowed.items()
        )
        return f"noise, or what the model's identification may be off ({' and '.join(shares)})"

    def step(self, output: str) -> float:
        """Return the quantization step of an output's readings, in its unit; 0 where none is visible, or none read."""
        if output in self.steps:
            return self.steps[output]
        return _quantization_step(self.records, output, self.thresholds.problem)

    def size(self, output: str) -> float:
        """Return the RMS of a measured output over all scored samples, in its unit; 1 if it is zero.

        It is taken about the mean where the subject's `about_mean` is set.
        """
        values = np.concatenate([record.measured[output][record.first :] for record in self.records])
        return float(values.std() if self.subject.size_is_variation else np.sqrt(np.mean(values**2))) or 1.0


@lru_cache(maxsize=4)
def _first_samples(records: tuple[FitRecord, ...], each: int) -> tuple[FitRecord, ...]:
    return tuple(shorten(record, max(each, record.first + each // 2)) for record in records)


@lru_cache(maxsize=8)
def _quantization_step(records: tuple[FitRecord, ...], output: str, thresholds: ProblemThresholds) -> float:
    read = [record.measured[output] for record in records if output in record.measured]
    return quantization_step(read, thresholds) if read else 0.0
