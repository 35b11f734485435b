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

from rtctl.border.kernels import kernel

SPIN_QUANTILE = 0.998
SPIN_GAIN_NS = 6000.0
FIRST_SPIN_NS = 60_000.0
LARGEST_SPIN_SHARE = 0.2
"""Longest spin as a share of the period: Linux stops a real-time task that computes for over 95 % of a second."""
MOST_BEHIND = 10
"""Periods that `catch_up` makes up for; older ones are skipped."""


@kernel
def due_tick(tick: int, now_ns: int, start_ns: int, period_ns: int, most_behind: int) -> int:
    """Return the next deadline to wait for, counted in periods since the start.

    Args:
        tick: the last deadline that was waited for.
        now_ns: time now [ns].
        start_ns: time of deadline 0 [ns].
        period_ns: sample period [ns].
        most_behind: periods that are made up for; deadlines further back are skipped.
    """
    return max(tick + 1, (now_ns - start_ns) // period_ns - most_behind)


@kernel
def adapted_spin_ns(
    spin_ns: float, late_ns: int, longer_ns: float, shorter_ns: float, most_ns: float
) -> float:
    """Return the length of the next spin: one step of the approximation in the module's head.

    Args:
        spin_ns: length of this spin [ns].
        late_ns: how much longer than asked the sleep before it lasted [ns].
        longer_ns: g q [ns].
        shorter_ns: g (1 - q) [ns].
        most_ns: longest spin [ns].
    """
    adapted_ns = spin_ns + longer_ns if late_ns > spin_ns else spin_ns - shorter_ns
    return max(min(adapted_ns, most_ns), 0.0)


class Tick(NamedTuple):
    """A deadline that the loop has reached."""

    step: int
    """Whole periods since the start; it jumps if deadlines were missed."""
    lateness_s: float
    """How long after its deadline the loop woke up [s]; 0 on a simulated clock."""


class Missed(StrEnum):
    """What to do about a period whose deadline passed before the loop came to it."""

    SKIP = "skip"
    CATCH_UP = "catch_up"


class Spin(Protocol):
    """A rule for how long before a deadline the sleep ends."""

    length_ns: float

    def woke(self, late_ns: int) -> None:
        """Learn from a sleep that lasted `late_ns` [ns] longer than asked."""
        ...


class NoSpin:
    """No spin: the sleep ends at the deadline."""

    length_ns = 0.0

    def woke(self, late_ns: int) -> None:
        """Learn nothing."""


class TrackedSpin:
    """A spin as long as a quantile of the wake-ups' lateness, at most `most_ns` [ns]."""

    def __init__(self, most_ns: float, quantile: float = SPIN_QUANTILE) -> None:
        self.most_ns = float(most_ns)  # a kernel is compiled for the types that it is called with
        self.length_ns = min(FIRST_SPIN_NS, self.most_ns)
        self.longer_ns = SPIN_GAIN_NS * quantile
        self.shorter_ns = SPIN_GAIN_NS * (1.0 - quantile)

    def woke(self, late_ns: int) -> None:
        """Adapt the length; see `Spin`."""
        self.length_ns = adapted_spin_ns(
            self.length_ns, late_ns, self.longer_ns, self.shorter_ns, self.most_ns
        )


class SimulatedClock:
    """Clock of lockstep runs: each step takes its period by definition, so nothing is ever late."""

    def __init__(self) -> None:
        self.index = -1

    def start(self, period_s: float) -> None:
        """Start at step 0; no machine time enters a lockstep run."""
        self.index = -1

    def wait(self) -> Tick:
        """Return the next step at once."""
        self.index += 1
        return Tick(self.index, 0.0)


class MonotonicClock:
    """Clock of live runs: deadlines at `start + index * period`, whose phase is kept whatever is missed.

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
        """Take time from `now_ns` [ns] and sleep by `sleep` [s]: the machine's, or a test's."""
        self.spin: Spin = spin or NoSpin()
        self._now_ns = now_ns
        self._sleep = sleep  # Python's own sleeps until an absolute time of the monotonic clock
        self.most_behind = 0 if missed is Missed.SKIP else MOST_BEHIND
        self.period_ns = 0
        self.start_ns = 0
        self.index = -1

    @property
    def is_the_machines(self) -> bool:
        """Whether time and sleep are the machine's, not a test's."""
        return self._now_ns is time.monotonic_ns and self._sleep is time.sleep

    def start(self, period_s: float) -> None:
        """Set the first deadline to now."""
        self.period_ns = round(period_s * 1e9)
        self.start_ns = self._now_ns()
        self.index = -1

    def wait(self) -> Tick:
        """Sleep, then spin, until the next deadline that the policy does not skip."""
        now_ns = self._now_ns
        begun_ns = now_ns()
        self.index = index = due_tick(self.index, begun_ns, self.start_ns, self.period_ns, self.most_behind)
        deadline_ns = self.start_ns + index * self.period_ns
        spin = self.spin
        wake_ns = deadline_ns - int(spin.length_ns)
        if wake_ns > begun_ns:
            self._sleep((wake_ns - begun_ns) * 1e-9)
            spin.woke(now_ns() - wake_ns)
        while (woken_ns := now_ns()) < deadline_ns:
            pass
        return Tick(index, (woken_ns - deadline_ns) * 1e-9)
