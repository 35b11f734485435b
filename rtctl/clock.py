"""Time as the loop sees it: simulated for lockstep runs, monotonic with absolute deadlines for live ones."""

from __future__ import annotations

import time


class SimulatedClock:
    """Steps take their period by definition: the device advances when it is asked to, so nothing is ever late."""

    def __init__(self) -> None:
        self.overruns = 0

    def start(self, period_s: float) -> None:
        """Nothing to start: no machine time enters a lockstep run."""

    def wait(self, step: int) -> float:
        """Zero lateness [s]."""
        return 0.0


class MonotonicClock:
    """Deadlines at `start + step * period`; a missed one skips whole periods and keeps the phase.

    A relative limiter that re-bases on "now" would turn lateness into drift.
    """

    def __init__(self) -> None:
        self.overruns = 0
        self._period_ns = 0
        self._next_ns = 0

    def start(self, period_s: float) -> None:
        """The first deadline is one period from now."""
        self._period_ns = round(period_s * 1e9)
        self._next_ns = time.monotonic_ns() + self._period_ns

    def wait(self, step: int) -> float:
        """Sleep until the deadline of this step; lateness [s] of the wake-up."""
        ahead_ns = self._next_ns - time.monotonic_ns()
        if ahead_ns > 0:
            time.sleep(ahead_ns * 1e-9)
        late_ns = time.monotonic_ns() - self._next_ns
        missed = late_ns // self._period_ns
        self.overruns += missed
        self._next_ns += (1 + missed) * self._period_ns
        return late_ns * 1e-9
