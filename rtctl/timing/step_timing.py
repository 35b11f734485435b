"""Timing of a loop's steps: histograms in constant memory, and the rule when missed periods are too many."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.border.arrays import IntArray
from rtctl.border.errors import DriverError, Fault
from rtctl.border.kernels import kernel
from rtctl.timing.histogram import BUCKETS, Histogram, count_duration

FORGIVEN_AFTER = 100
"""Steps in time after which one missed period is forgiven."""
GRACE_STEPS = 10
"""Steps at the start whose missed periods are counted but not judged: caches are cold."""


@kernel
def count_step(counts: IntArray, lateness_ns: int, round_trip_ns: int, compute_ns: int) -> None:
    """Count one step in the three histograms of `counts` (3, BUCKETS + 1), in the order of the arguments [ns]."""
    count_duration(counts, 0, lateness_ns)
    count_duration(counts, 1, round_trip_ns)
    count_duration(counts, 2, compute_ns)


class StepTiming:
    """Lateness, round trip and compute time of every step, and the missed periods."""

    def __init__(self, stop_after: int | None = None) -> None:
        """End the run after `stop_after` missed periods, less those forgiven; None: never."""
        self.counts = np.zeros((3, BUCKETS + 1), dtype=np.int64)
        """Counts of the three histograms, for `count_step`."""
        self.lateness, self.round_trip, self.compute = (Histogram(self.counts[k : k + 1]) for k in range(3))
        self.steps = 0
        self.overruns = 0
        self._stop_after = stop_after
        self._held_against = 0
        self._judged_at = 0

    @property
    def judges(self) -> bool:
        """Whether missed periods can end the run."""
        return self._stop_after is not None

    def step(self, lateness_ns: int, round_trip_ns: int, compute_ns: int) -> None:
        """Count one step; durations [ns]."""
        self.steps += 1
        count_step(self.counts, lateness_ns, round_trip_ns, compute_ns)

    def missed(self, periods: int) -> None:
        """Count `periods` deadlines that passed before this step. Raise DriverError if they are too many."""
        self.overruns += periods
        if self._stop_after is None or self.steps < GRACE_STEPS:
            return
        forgiven = (self.steps - self._judged_at) // FORGIVEN_AFTER
        self._judged_at += FORGIVEN_AFTER * forgiven
        self._held_against = max(self._held_against - forgiven, 0)
        if self._held_against == 0:
            self._judged_at = self.steps
        self._held_against += periods
        if self._held_against >= self._stop_after:
            raise DriverError(
                Fault.DEADLINES_MISSED,
                f"{self.overruns} periods missed, {periods} of them just now, at most {self._stop_after} are allowed "
                "(clock.stop_after; one is forgiven a hundred steps in time); a longer period helps, or "
                "clock.priority: rtctl latency measures what this machine and wire hold",
            )

    def summary(self, period_s: float) -> dict[str, Any]:
        """Return `timing` of a run's summary [us]; the histograms as counts between 1, 2, 5, 10 ... us."""
        return {
            "period_s": period_s,
            "steps": self.steps,
            "overruns": self.overruns,
            "lateness_us": self.lateness.summary_us(),
            "round_trip_us": self.round_trip.summary_us(),
            "compute_us": self.compute.summary_us(),
            "histograms_us": {
                "lateness": self.lateness.decades_us(),
                "round_trip": self.round_trip.decades_us(),
                "compute": self.compute.decades_us(),
            },
        }
