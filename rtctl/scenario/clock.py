"""[clock] of a scenario: whose time it is, what a missed deadline means, what is asked of the machine."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rtctl.border.errors import InputError
from rtctl.border.units.quantities import Checked, Quantity
from rtctl.timing.clock import LARGEST_SPIN_SHARE, Missed, MonotonicClock, NoSpin, TrackedSpin
from rtctl.timing.realtime import RealTime

Seconds = Annotated[float, Quantity("s"), Field(allow_inf_nan=False)]
WATCHDOG_PERIODS = 10.0
LEAST_WATCHDOG_S = 0.1
LOCKSTEP_WATCHDOG_S = 60.0
"""In lockstep nothing is late, and a host may pause as long as it likes, to compile or for a controller that optimises:
twice the longest such pause that is known. The device of another counts it on the wall's clock all the same."""
LONGEST_WATCHDOG_S = 65.535
"""What its register can hold."""


class ClockTable(Checked):
    """Table [clock]."""

    mode: Literal["lockstep", "live"] = "lockstep"
    settle_s: Annotated[Seconds, Field(alias="settle", ge=0.0)] = 0.05
    """Full cooling at the safe level before the first sample."""
    timeout_s: Annotated[Seconds | None, Field(alias="timeout", gt=0.0)] = None
    """For one exchange; default: five periods, at least 50 ms (lockstep: 1 s)."""
    watchdog_s: Annotated[Seconds | None, Field(alias="watchdog", ge=0.0)] = None
    """The device's own; default: ten periods, at least 100 ms (lockstep: a minute). "0 s": none."""
    missed: Literal["skip", "catch_up", "stop"] = "skip"
    """Live: periods that were missed are left out, made up for, or end the run after `stop_after` of them."""
    stop_after: Annotated[int, Field(ge=1)] = 10
    """Missed periods that end a run with missed = "stop"; one is forgiven a hundred steps in time."""
    spin_s: Annotated[Seconds | None, Field(alias="spin", ge=0.0)] = None
    """Most that is spun before a deadline; default: a fifth of the period. "0 s": none."""
    priority: Annotated[int | None, Field(ge=1, le=99)] = None
    """Priority of SCHED_FIFO; None: the usual scheduler."""
    cpu: Annotated[int | None, Field(ge=0)] = None
    """Live: the only CPU of the loop."""
    unlocked: bool = True
    """Steps are taken in compiled blocks without the interpreter's lock where that is possible; false: in Python."""
    lock_memory: bool = False
    freeze_gc: bool = True

    @model_validator(mode="after")
    def _representable(self) -> ClockTable:
        watchdog_ms = 1e3 * (self.watchdog_s or 0.0)
        if not (watchdog_ms == 0.0 or 1.0 <= watchdog_ms <= 1e3 * LONGEST_WATCHDOG_S):
            raise ValueError(f"watchdog = {watchdog_ms:g} ms must be 0 (none) or 1 to 65535 ms")
        return self

    def lease_s(self, period_s: float) -> float:
        """Return how long the device holds a command that is not renewed [s], at a period [s]; 0: without end.

        Raises:
            InputError: no watchdog is as long as a period, and going without one was not asked for.
        """
        if self.watchdog_s is not None:
            return self.watchdog_s
        if period_s > LONGEST_WATCHDOG_S:
            raise InputError(
                f"clock.watchdog: a watchdog lasts {LONGEST_WATCHDOG_S:g} s at most, a period {period_s:g} s; "
                '--set clock.watchdog="0 s" lets the device hold every command without end'
            )
        least_s = LOCKSTEP_WATCHDOG_S if self.mode == "lockstep" else LEAST_WATCHDOG_S
        return min(max(WATCHDOG_PERIODS * period_s, least_s), LONGEST_WATCHDOG_S)

    def real_time(self) -> RealTime:
        """Return what is asked of the machine in a live run."""
        return RealTime(
            priority=self.priority, cpu=self.cpu, lock_memory=self.lock_memory, freeze_gc=self.freeze_gc
        )

    def monotonic(self, period_s: float) -> MonotonicClock:
        """Return the clock of a live run with this period [s]."""
        share_s = LARGEST_SPIN_SHARE * period_s
        most_s = share_s if self.spin_s is None else min(self.spin_s, share_s)
        missed = Missed.CATCH_UP if self.missed == "catch_up" else Missed.SKIP
        spin = TrackedSpin(1e9 * most_s) if most_s > 0.0 else NoSpin()
        return MonotonicClock(missed=missed, spin=spin)
