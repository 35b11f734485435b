"""What no healthy device says and no sound controller asks, seen over time; each finding has a name of its own.

`Plausibility` judges a reading by itself; `ReadingGuard` against those before it: rate, a value that is stuck while the
command moves, a counter that jumps, a device clock that stands, jumps or runs off. `EnergyGuard` watches the power that
commands put into the device,

    m[k] = u^2 + (m[k-1] - u^2) exp(-h / window),   sqrt(m) <= rms

the root mean square of the command over a sliding window, and finds out before the command is sent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import Measurement
from rtctl.safety.limits import CommandLimits

_UINT32, _HALF = 0xFFFFFFFF, 0x80000000
ANCHOR_US = 1e6
"""How long host and device clock are compared from one point: a clock that runs off is found within that."""
LARGEST_RATE_ERROR = 0.05
"""Of a device's clock; a quartz is off by a ten-thousandth."""
LEAST_TIME_TOLERANCE_US = 20_000.0
COUNTS_PER_US = 1
"""No instrument here measures more than once a microsecond, so a counter that has moved on by more has jumped."""

Finding = tuple[Fault, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingRules:
    """What is believed of readings over time; infinite or 0 where nothing is known."""

    names: tuple[str, ...]
    """Channel names with units."""
    rates: tuple[float, ...]
    """Largest change of each reading a second, in its unit."""
    frozen_after: int = 0
    """Equal readings in a row, to the bit, that are a stuck sensor if the command moved meanwhile; 0: any number."""
    frozen_travel: float = math.inf
    """How far the first command must have moved meanwhile, in its unit."""
    lockstep_us: int | None = None
    """Sample period of the device where each command advances it by one."""
    time_tolerance_us: float = LEAST_TIME_TOLERANCE_US
    """How old a device's time may be when it answers: a sample of its own."""
    timed: bool = True
    """Whether counter and time are looked at."""


class GuardMemory(NamedTuple):
    """What a `ReadingGuard` has seen."""

    counts: int | None
    """By which a command in lockstep advanced the counter."""
    equal: int
    lowest: float
    highest: float
    """Levels since the readings have been equal, so many of them."""
    anchor: tuple[int, int, int] | None
    """Device time [us], host before and after [ns]."""


class ReadingGuard:
    """Judges each reading against those before it. `start` forgets them."""

    def __init__(self, rules: ReadingRules) -> None:
        self.rules = self._rules = rules
        self._rated = any(math.isfinite(rate) for rate in rules.rates)
        self._counts: int | None = None
        self._equal = 0
        self._lowest = self._highest = 0.0
        self._anchor: tuple[int, int, int] | None = None  # device time [us], host before and after [ns]

    def start(self) -> None:
        """No reading is known: of a run, and after a fault."""
        self._counts = None
        self._equal = 0
        self._anchor = None

    def memory(self) -> GuardMemory:
        """For a compiled block of steps."""
        return GuardMemory(self._counts, self._equal, self._lowest, self._highest, self._anchor)

    def resume(self, memory: GuardMemory) -> None:
        """Go on from there."""
        self._counts, self._equal, self._lowest, self._highest, self._anchor = memory

    def judge(
        self,
        new: Measurement,
        previous: Measurement,
        level: float,
        elapsed_s: float,
        begun_ns: int,
        answered_ns: int,
    ) -> Finding | None:
        """The fault of `new`, asked for at `begun_ns` and here at `answered_ns` (host time), or None.

        `level` is the first command that it answers, `elapsed_s` the time since `previous`.
        """
        rules = self._rules
        if new.sensed == previous.sensed:
            if rules.frozen_after and (found := self._stuck(new, level)):
                return found
        else:
            self._equal = 0
            if self._rated and (found := self._too_fast(new, previous, elapsed_s)):
                return found
        return self._out_of_time(new, previous, begun_ns, answered_ns) if rules.timed else None

    def _out_of_time(
        self, new: Measurement, previous: Measurement, begun_ns: int, answered_ns: int
    ) -> Finding | None:
        lockstep_us = self._rules.lockstep_us
        advance = (new.time_us - previous.time_us) & _UINT32
        counts = (new.counter - previous.counter) & _UINT32
        if lockstep_us is not None:
            if counts != self._counts or abs(advance - lockstep_us) > 2:
                return self._out_of_step(counts, advance, lockstep_us)
            return None
        if not 0 < advance < _HALF:
            return Fault.DEVICE_TIME, _stands(previous.time_us, new.time_us)
        if counts > COUNTS_PER_US * advance:
            return Fault.COUNTER_JUMP, (
                f"the sample counter went on by {counts} in {advance} us of device time: it has jumped"
            )
        return self._running_off(new.time_us, begun_ns, answered_ns)

    def _stuck(self, new: Measurement, level: float) -> Finding | None:
        if self._equal == 0:
            self._lowest = self._highest = level
        self._equal += 1
        self._lowest, self._highest = min(self._lowest, level), max(self._highest, level)
        travel = self._highest - self._lowest
        if self._equal < self._rules.frozen_after or travel < self._rules.frozen_travel:
            return None
        return Fault.FROZEN_VALUE, (
            f"{self._rules.names[0]} has read {new.sensed[0]!r} {self._equal + 1} times in a row while the command "
            f"moved by {travel:.4g}: the sensor is stuck (safety.frozen_after)"
        )

    def _too_fast(self, new: Measurement, previous: Measurement, elapsed_s: float) -> Finding | None:
        for name, value, before, rate in zip(
            self._rules.names, new.sensed, previous.sensed, self._rules.rates, strict=True
        ):
            if abs(value - before) > rate * elapsed_s:
                return Fault.RATE, (
                    f"{name} went from {before:.6g} to {value:.6g} in {1e3 * elapsed_s:.4g} ms, faster than the "
                    f"plausible {rate:.4g} a second (limits.sensed_rate)"
                )
        return None

    def _out_of_step(self, counts: int, advance: int, period_us: int) -> Finding | None:
        if abs(advance - period_us) > 2:
            return Fault.DEVICE_TIME, (
                f"one command in lockstep advanced the device's time by {advance} us, its sample period is {period_us} "
                "us"
            )
        expected, self._counts = self._counts, counts
        if expected is None:
            return None
        return Fault.COUNTER_JUMP, (
            f"the sample counter went on by {counts}, until now each command advanced it by {expected}: samples are "
            "missing, or another client drives this device"
        )

    def _running_off(self, time_us: int, begun_ns: int, answered_ns: int) -> Finding | None:
        """The device's time lies between the request and its answer, whatever the wire and the host did."""
        if self._anchor is None:
            self._anchor = (time_us, begun_ns, answered_ns)
            return None
        anchor_us, anchor_begun_ns, anchor_answered_ns = self._anchor
        device_us = (time_us - anchor_us) & _UINT32
        least_us = 1e-3 * (begun_ns - anchor_answered_ns)
        most_us = 1e-3 * (answered_ns - anchor_begun_ns)
        slack_us = self._rules.time_tolerance_us
        if not least_us * (1.0 - LARGEST_RATE_ERROR) - slack_us <= device_us:
            return Fault.DEVICE_TIME, _ran(device_us, least_us, "slow")
        if device_us > most_us * (1.0 + LARGEST_RATE_ERROR) + slack_us:
            return Fault.DEVICE_TIME, _ran(device_us, most_us, "fast")
        if least_us > ANCHOR_US:
            self._anchor = (time_us, begun_ns, answered_ns)
        return None


class EnergyGuard:
    """Watches the mean square of each command; `start` begins at the applied levels."""

    def __init__(self, limits: Sequence[CommandLimits], names: Sequence[str]) -> None:
        """`names`: of the commands, with their units."""
        self._watched = [
            (index, limit.rms * limit.rms, limit.rms_window_s, names[index])
            for index, limit in enumerate(limits)
            if math.isfinite(limit.rms)
        ]
        self.mean_squares = [0.0] * len(self._watched)
        """Of the commands that have a limit, in their order."""

    def start(self, levels: Sequence[float]) -> None:
        """The levels have been applied for long."""
        self.mean_squares = [levels[index] ** 2 for index, *_ in self._watched]

    def refuse_too_much(self, levels: Sequence[float], period_s: float) -> None:
        """Raise DriverError before a command is sent that would put in too much over its window."""
        for k, (index, most, window_s, name) in enumerate(self._watched):
            square = levels[index] * levels[index]
            mean = square + (self.mean_squares[k] - square) * math.exp(-period_s / window_s)
            if mean > most:
                raise DriverError(
                    Fault.ENERGY_LIMIT,
                    f"the next {name}, {levels[index]:.4g}, would bring its root mean square over {window_s:g} s to "
                    f"{math.sqrt(mean):.4g}, at most {math.sqrt(most):.4g} is allowed (limits.rms)",
                )
            self.mean_squares[k] = mean


def _stands(before_us: int, now_us: int) -> str:
    return f"the device's time went from {before_us} to {now_us} us with a new sample: its clock stands or was set back"


def _ran(device_us: float, host_us: float, how: str) -> str:
    device_ms, host_ms = 1e-3 * device_us, 1e-3 * host_us
    return (
        f"the device's clock runs {how}: {device_ms:.4g} ms of its time in {host_ms:.4g} ms of this machine's"
    )
