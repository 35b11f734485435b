"""Time as the loop sees it: simulated for lockstep runs, monotonic with absolute deadlines for live ones.

A live step sleeps until shortly before its deadline, then spins. How long it spins follows what the machine does: the
quantile `SPIN_QUANTILE` of the wake-ups' own lateness, tracked by stochastic approximation,

    s <- s + g q   where a wake-up was later than s,   s <- s - g (1 - q)   where it was not

so that one wake-up in 500 outlasts the spin. Reference: H. Robbins, S. Monro, Ann. Math. Statist. 22 (1951).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple, Protocol

SPIN_QUANTILE = 0.998
SPIN_GAIN_NS = 6000.0
FIRST_SPIN_NS = 60_000.0
LARGEST_SPIN_SHARE = 0.2
"""Of a period: the kernel stops a real-time task that computes for more than 95 % of a second."""
MOST_BEHIND = 10
"""Periods that `catch_up` makes up for; beyond, whole periods are skipped."""


class Tick(NamedTuple):
    """One deadline that the loop has reached."""

    step: int
    """Whole periods since the start; jumps where deadlines were missed."""
    lateness_s: float
    """How long after its deadline the loop woke up [s]; 0 on a simulated clock."""


class Missed(StrEnum):
    """What becomes of a period whose deadline has passed before the loop came to it."""

    SKIP = "skip"
    CATCH_UP = "catch_up"


class Spin(Protocol):
    """How long before a deadline the sleep ends."""

    length_ns: float

    def woke(self, late_ns: int) -> None:
        """A sleep lasted `late_ns` [ns] longer than it was asked to."""
        ...


class NoSpin:
    """Sleep to the end."""

    length_ns = 0.0

    def woke(self, late_ns: int) -> None:
        """Nothing to learn."""


class TrackedSpin:
    """The wake-ups' lateness at a quantile, at most `most_ns` [ns]."""

    def __init__(self, most_ns: float, quantile: float = SPIN_QUANTILE) -> None:
        self.length_ns = min(FIRST_SPIN_NS, most_ns)
        self.most_ns = most_ns
        self.longer_ns = SPIN_GAIN_NS * quantile
        self.shorter_ns = SPIN_GAIN_NS * (1.0 - quantile)

    def woke(self, late_ns: int) -> None:
        """One step of the approximation."""
        if late_ns > self.length_ns:
            self.length_ns = min(self.length_ns + self.longer_ns, self.most_ns)
        else:
            self.length_ns = max(self.length_ns - self.shorter_ns, 0.0)


class SimulatedClock:
    """Steps take their period by definition: the device advances when it is asked to, so nothing is ever late."""

    def __init__(self) -> None:
        self.index = -1

    def start(self, period_s: float) -> None:
        """Nothing to start: no machine time enters a lockstep run."""
        self.index = -1

    def wait(self) -> Tick:
        """The next step at once."""
        self.index += 1
        return Tick(self.index, 0.0)


class MonotonicClock:
    """Deadlines at `start + index * period`; the phase is kept whatever is missed.

    A relative limiter that re-bases on "now" would turn lateness into drift.
    """

    def __init__(
        self,
        now_ns: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
        *,
        missed: Missed = Missed.SKIP,
        spin: Spin | None = None,
    ) -> None:
        """`now_ns` [ns] and `sleep` [s]: the machine's, or a test's."""
        self.spin: Spin = spin or NoSpin()
        self._now_ns = now_ns
        self._sleep = sleep  # Python's own sleeps until an absolute time of the monotonic clock
        self.most_behind = 0 if missed is Missed.SKIP else MOST_BEHIND
        self.period_ns = 0
        self.start_ns = 0
        self.index = -1

    @property
    def is_the_machines(self) -> bool:
        """Whether no test has put a clock of its own here."""
        return self._now_ns is time.monotonic_ns and self._sleep is time.sleep

    def start(self, period_s: float) -> None:
        """The first deadline is now."""
        self.period_ns = round(period_s * 1e9)
        self.start_ns = self._now_ns()
        self.index = -1

    def wait(self) -> Tick:
        """Sleep, then spin, until the next deadline that the policy does not skip."""
        now_ns = self._now_ns
        begun_ns = now_ns()
        self.index = index = max(
            self.index + 1, (begun_ns - self.start_ns) // self.period_ns - self.most_behind
        )
        deadline_ns = self.start_ns + index * self.period_ns
        spin = self.spin
        wake_ns = deadline_ns - int(spin.length_ns)
        if wake_ns > begun_ns:
            self._sleep((wake_ns - begun_ns) * 1e-9)
            spin.woke(now_ns() - wake_ns)
        while (woken_ns := now_ns()) < deadline_ns:
            pass
        return Tick(index, (woken_ns - deadline_ns) * 1e-9)
