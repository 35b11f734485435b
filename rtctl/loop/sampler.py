"""One sample after the other in Python: wait, exchange, check, decide, record. `rtctl.unlocked` has it compiled."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import Driver, Measurement
from rtctl.interfaces import Clock, Controller, Estimator, SignalRecorder
from rtctl.loop.events import Events
from rtctl.loop.live_parameters import SETPOINT, ParameterChannel
from rtctl.loop.step import Levels, Step, upcoming_setpoints
from rtctl.safety.guards import EnergyGuard, ReadingGuard
from rtctl.safety.limits import CommandLimits, Plausibility
from rtctl.timing.step_timing import StepTiming


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopParts:
    """Everything that the loop calls, already real or simulated: `rtctl.wiring` decides."""

    driver: Driver
    estimator: Estimator
    controller: Controller
    limits: tuple[CommandLimits, ...]
    plausibility: Plausibility
    clock: Clock
    signals: SignalRecorder
    timings: SignalRecorder
    stop_requested: Callable[[], bool]
    step: Step | None = None
    """Estimator, controller and limits as one; None: one after the other."""
    compiled: bool = False
    """Samples are taken in compiled blocks where driver, step and clock can (`rtctl.unlocked`)."""
    guard: ReadingGuard | None = None
    """Of readings over time; None: each is judged by itself."""
    energy: EnergyGuard = field(default_factory=lambda: EnergyGuard((), ()))
    reopen: Callable[[], Measurement] | None = None
    """Opens the driver again, which re-arms the device; None: the first fault ends the run."""
    timing: StepTiming = field(default_factory=StepTiming)
    events: Events = field(default_factory=Events)
    changes: ParameterChannel = field(default_factory=ParameterChannel)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopPlan:
    """What a run does: the setpoint of each sample [controlled unit] after a settling hold at the safe levels."""

    period_s: float
    setpoints: NDArray[np.float64]
    settle_steps: int
    reading_delay: int = 0
    """Commands back to the one that was applied when a reading was taken: 0 in lockstep, 1 live, more pipelined."""
    rearm_times: int = 0
    """How many faults of wire or device a run survives."""
    rearm_after_s: float = 0.0
    """How long the device is left off before it is armed again."""


@dataclass(slots=True)
class Position:
    """The last sample that was recorded; -1 before the first. It outlives a fault."""

    index: int = -1
    setpoint: float = math.nan
    """What somebody set instead of the plan's; NaN: nothing."""


class Sampler:
    """The samples of a plan after `at`, from rest at the safe levels. What outlives a sample is public."""

    def __init__(
        self, parts: LoopParts, plan: LoopPlan, step: Step, reading: Measurement, safe: Levels, at: Position
    ) -> None:
        """The step starts here. Raises DriverError on a first level that is too much."""
        self.parts, self.plan, self.step, self.at = parts, plan, step, at
        self.reading = reading
        self.period_s = period_s = plan.period_s
        self.first, self.last = at.index + 1, len(plan.setpoints) - 1
        self.setpoints = plan.setpoints
        self.upcoming = upcoming_setpoints(plan.setpoints, period_s, step.preview_s)
        self._setpoints, self._upcoming = floats(self.setpoints), floats(self.upcoming)
        parts.events.note(self.first, "start", sensed=reading.sensed, levels=safe)
        self.sent = deque((plan.reading_delay + 1) * [safe], maxlen=plan.reading_delay + 1)
        beginning = self._setpoints[self.first] if at.setpoint != at.setpoint else at.setpoint
        self.levels = step.start(safe, beginning, reading.sensed, period_s)
        parts.energy.refuse_too_much(self.levels, period_s)
        self._record, self._record_timing = parts.signals.append, parts.timings.append
        self._guarded, self._timing, self._changes = parts.guard is not None, parts.timing, parts.changes
        self._wait, self._exchange, self._decide = parts.clock.wait, parts.driver.exchange, step.step
        self._refuse_too_much = parts.energy.refuse_too_much

    def run(self) -> None:
        """All of them. Raises DriverError."""
        self.parts.clock.start(self.period_s)
        while self.at.index < self.last and self.take():
            pass

    def take(self) -> bool:
        """The next one; False: the last ones went by. Raises DriverError."""
        tick, lateness_s = self._wait()
        index = self.first + tick
        missed = index - self.at.index - 1
        if index > self.last:
            self._timing.overruns += self.last - self.at.index
            return False
        if missed:
            self.missed(missed)
        self.exchange(index, missed, lateness_s)
        return True

    def exchange(self, index: int, missed: int, lateness_s: float) -> None:
        """A sample from its exchange on. Raises DriverError."""
        begun_ns = time.perf_counter_ns()
        new = self._exchange(self.levels)
        self.complete(index, missed, lateness_s, new, begun_ns, time.perf_counter_ns())

    def missed(self, periods: int) -> None:
        """So many went by before this sample. Raises DriverError."""
        self._timing.missed(periods)
        self._refuse_too_much(self.levels, periods * self.period_s)  # they were held meanwhile

    def complete(
        self, index: int, missed: int, lateness_s: float, new: Measurement, begun_ns: int, answered_ns: int
    ) -> None:
        """A sample from its reading on. Raises DriverError."""
        elapsed_s = (missed + 1) * self.period_s
        refuse_implausible(self.parts, new, self.reading)
        if self._guarded:
            refuse_unlikely(self.parts, new, self.reading, self.levels[0], elapsed_s, begun_ns, answered_ns)
        self.reading = new
        self.decide(index, elapsed_s, lateness_s, begun_ns, answered_ns)

    def decide(
        self, index: int, elapsed_s: float, lateness_s: float, begun_ns: int, answered_ns: int
    ) -> None:
        """A sample from its judged reading on. Raises DriverError."""
        at, reading, commanded = self.at, self.reading, self.levels
        if self._changes:
            _change(self.parts, self.step, index, at)
        setpoint, aimed = self._setpoints[index], self._upcoming[index]
        if at.setpoint == at.setpoint:
            setpoint = aimed = at.setpoint
        self.sent.append(commanded)
        estimate, levels, terms = self._decide(
            setpoint, aimed, self.sent[0], commanded, reading.sensed, elapsed_s
        )
        self.levels = levels
        self._refuse_too_much(levels, self.period_s)
        self.record((index, setpoint, *estimate, reading.reference, *reading.sensed, *commanded, *terms,
                     reading.counter, reading.time_us, reading.status), lateness_s, begun_ns, answered_ns)  # fmt: skip
        at.index = index

    def record(self, row: tuple[float, ...], lateness_s: float, begun_ns: int, answered_ns: int) -> None:
        """The row of a sample, and how long it took. Raises DriverError."""
        self._record(row)
        decided_ns = time.perf_counter_ns()
        round_trip_ns, compute_ns = answered_ns - begun_ns, decided_ns - answered_ns
        self._record_timing((lateness_s * 1e6, round_trip_ns * 1e-3, compute_ns * 1e-3))
        self._timing.step(int(lateness_s * 1e9), round_trip_ns, compute_ns)


def floats(values: NDArray[np.float64]) -> Sequence[float]:
    """A view whose items are Python's floats; a list of them would be five times as large."""
    return memoryview(np.ascontiguousarray(values))  # type: ignore[arg-type]


def _change(parts: LoopParts, step: Step, index: int, at: Position) -> None:
    """One change a step, so that a flood of them costs the loop no more than one."""
    change = parts.changes.take()
    try:
        if change.name == SETPOINT:
            at.setpoint = change.value
        else:
            step.change(change.name, change.value)
    except InputError as error:
        parts.changes.refused.append((change, str(error)))
        parts.events.note(index, "refused", name=change.name, value=change.value, message=str(error))
    else:
        parts.events.note(index, "change", name=change.name, value=change.value)


def refuse_implausible(parts: LoopParts, new: Measurement, previous: Measurement) -> None:
    """Raise DriverError for a reading that must not be controlled on, or when the user asked to stop."""
    found = parts.plausibility.judge(new, previous)
    if found is not None:
        raise DriverError(*found)
    refuse_interrupted(parts)


def refuse_unlikely(
    parts: LoopParts,
    new: Measurement,
    previous: Measurement,
    level: float,
    elapsed_s: float,
    begun_ns: int,
    answered_ns: int,
) -> None:
    """Raise DriverError for a reading that does not follow on those before it."""
    if parts.guard is not None:
        found = parts.guard.judge(new, previous, level, elapsed_s, begun_ns, answered_ns)
        if found is not None:
            raise DriverError(*found)


def refuse_interrupted(parts: LoopParts) -> None:
    """Raise DriverError when the user asked to stop."""
    if parts.stop_requested():
        raise DriverError(Fault.INTERRUPTED, "stopped by the user; what was recorded until then is written")
