"""Time as the loop sees it: simulated for lockstep runs, monotonic with absolute deadlines for live ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple


class Tick(NamedTuple):
    """One deadline that the loop has reached."""

    step: int
    """Whole periods since the start; jumps where deadlines were missed."""
    lateness_s: float
    """How long after its deadline the loop woke up [s]; 0 on a simulated clock."""


class SimulatedClock:
    """Steps take their period by definition: the device advances when it is asked to, so nothing is ever late."""

    def __init__(self) -> None:
        self._index = -1

    def start(self, period_s: float) -> None:
        """Nothing to start: no machine time enters a lockstep run."""
        self._index = -1

    def wait(self) -> Tick:
        """The next step at once."""
        self._index += 1
        return Tick(self._index, 0.0)


class MonotonicClock:
    """Deadlines at `start + index * period`; missed ones are skipped as whole periods, so the phase is kept.

    A relative limiter that re-bases on "now" would turn lateness into drift.
    """

    def __init__(
        self, now_ns: Callable[[], int] = time.monotonic_ns, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        """`now_ns` [ns] and `sleep` [s]: the machine's, or a test's."""
        self._now_ns = now_ns
        self._sleep = sleep
        self._period_ns = 0
        self._start_ns = 0
        self._index = -1

    def start(self, period_s: float) -> None:
        """The first deadline is now."""
        self._period_ns = round(period_s * 1e9)
        self._start_ns = self._now_ns()
        self._index = -1

    def wait(self) -> Tick:
        """Sleep until the next deadline that can still be met."""
        since_ns = self._now_ns() - self._start_ns
        self._index = max(self._index + 1, since_ns // self._period_ns)
        deadline_ns = self._start_ns + self._index * self._period_ns
        ahead_ns = deadline_ns - self._now_ns()
        if ahead_ns > 0:
            self._sleep(ahead_ns * 1e-9)
        return Tick(self._index, (self._now_ns() - deadline_ns) * 1e-9)
