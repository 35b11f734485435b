"""How the steps of a loop kept time: histograms of constant memory, and when missed periods are too many."""

from __future__ import annotations

from typing import Any

from rtctl.border.errors import DriverError, Fault
from rtctl.timing.histogram import Histogram

FORGIVEN_AFTER = 100
"""Steps in time for which one missed period is forgiven."""
GRACE_STEPS = 10
"""Steps at the start whose missed periods are counted and not judged: caches are cold."""


class StepTiming:
    """Lateness, round trip and compute time of every step, missed periods and the largest run of them."""

    def __init__(self, stop_after: int | None = None) -> None:
        """`stop_after`: missed periods, those forgiven left out, that end the run; None: they never do."""
        self.lateness, self.round_trip, self.compute = Histogram(), Histogram(), Histogram()
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
        """A step is done."""
        self.steps += 1
        self.lateness.record(lateness_ns)
        self.round_trip.record(round_trip_ns)
        self.compute.record(compute_ns)

    def missed(self, periods: int) -> None:
        """`periods` deadlines went by before this step. Raises DriverError where they are too many."""
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
                "clock.priority: rtctl latency tells what this machine and wire hold",
            )

    def summary(self, period_s: float) -> dict[str, Any]:
        """`timing` of a run's summary [us]; the histograms as counts between 1, 2, 5, 10 ... us."""
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
