"""Budget of a search in simulated work, so that an answer does not depend on the machine; seconds are only a guard."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from rtctl.border.work import current_meter
from rtctl.diagnosis.thresholds import BudgetThresholds


def _nothing_counted() -> float:
    return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WallClockGuard:
    """Outer guard [s] of wall-clock time, for machines on which the work takes too long; infinite: none."""

    seconds: float = np.inf
    started_s: float = field(default_factory=time.monotonic)

    @property
    def expired(self) -> bool:
        """Return whether the time is over."""
        return self.seconds < np.inf and time.monotonic() - self.started_s > self.seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkBudget:
    """Work [steps] that a search may do; asked before each fit and between the iterations of one.

    `steps` counts from `started_at` on the meter that `counted` reads. The best set found when the budget is spent
    goes through the residual tests as any other.
    """

    steps: float
    counted: Callable[[], float]
    started_at: float
    guard: WallClockGuard = field(default_factory=WallClockGuard)
    thresholds: BudgetThresholds = field(default_factory=BudgetThresholds)

    @classmethod
    def of(
        cls,
        steps: float | None = None,
        counted: Callable[[], float] | None = None,
        guard: WallClockGuard | None = None,
        thresholds: BudgetThresholds | None = None,
    ) -> WorkBudget:
        """Start a budget now.

        Args:
            steps: Work that may be done from now on [steps]; None: that of the thresholds.
            counted: Reads the work done so far [steps]; None: this thread's meter (without one, nothing is counted
                and the budget is never spent).
            guard: Outer guard of wall-clock time; None: no guard.
            thresholds: Amounts of work; None: the defaults.
        """
        thresholds = thresholds or BudgetThresholds()
        if counted is None:
            meter = current_meter()
            counted = _nothing_counted if meter is None else (lambda: meter.steps)
        return cls(
            steps=thresholds.search if steps is None else steps,
            counted=counted,
            started_at=counted(),
            guard=guard or WallClockGuard(),
            thresholds=thresholds,
        )

    def further(self, steps: float) -> WorkBudget:
        """Return the budget of a comparison of `steps` from now on, which may exceed this one by a bounded amount.

        An unlimited budget has unlimited comparisons.
        """
        if self.steps == np.inf:
            return self.restarted(np.inf)
        least, after = self.thresholds.least_comparison, self.thresholds.overrun
        return self.restarted(min(steps, max(least, self.left + after)))

    def for_longer_parts(self) -> WorkBudget:
        """Return the budget of a search that goes on where another one ended; of no more than that one had."""
        return self.restarted(min(self.steps, self.thresholds.longer_parts))

    def restarted(self, steps: float) -> WorkBudget:
        """Return a budget of `steps` from now on, on the same meter and behind the same guard."""
        return replace(self, steps=steps, started_at=self.counted())

    @property
    def left(self) -> float:
        """Return the work that is left [steps]; negative beyond the budget, minus infinity once the guard expired."""
        if self.guard.expired:
            return -np.inf
        return self.steps - (self.counted() - self.started_at)

    @property
    def spent(self) -> bool:
        """Return whether no further fit may begin."""
        return self.left <= 0.0

    @property
    def cut_by_clock(self) -> bool:
        """Return whether the wall-clock guard ended it: then the answer depends on the machine."""
        return self.guard.expired
