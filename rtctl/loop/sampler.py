"""The loop's samples, one after the other in Python: wait, exchange, check, decide, record.

`rtctl.loop.compiled` takes them in compiled blocks.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceStatus, Driver, Measurement
from rtctl.interfaces import Clock, Controller, Estimator, SignalRecorder
from rtctl.loop.events import START, Events
from rtctl.loop.live_parameters import MODEL, SETPOINT, STOP, ParameterChannel
from rtctl.loop.step import Levels, Step, upcoming_setpoints
from rtctl.loop.successor import hand_on
from rtctl.safety.guards import EnergyGuard, ReadingGuard
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility
from rtctl.timing.step_timing import StepTiming

REFUSED = int(DeviceStatus.REFUSED)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopParts:
    """Everything that the loop calls, real or simulated (`rtctl.wiring` decides)."""

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
    """Estimator, controller and limits as one call; None: they are called one after the other."""
    compiled: bool = False
    """Whether samples are taken in compiled blocks if driver, step and clock allow it (`rtctl.loop.compiled`)."""
    guard: ReadingGuard | None = None
    """Judges readings over time; None: each is judged by itself."""
    energy: EnergyGuard = field(default_factory=lambda: EnergyGuard((), ()))
    reopen: Callable[[], Measurement] | None = None
    """Opens the driver again, which re-arms the device; None: the first fault ends the run."""
    timing: StepTiming = field(default_factory=StepTiming)
    events: Events = field(default_factory=Events)
    changes: ParameterChannel = field(default_factory=ParameterChannel)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopPlan:
    """The plan of a run: a settling hold at the safe levels, then the setpoints."""

    period_s: float
    """Sample period [s]."""
    setpoints: FloatArray
    """Setpoint of each sample (n,) [controlled unit]."""
    settle_steps: int
    """Periods at the safe levels before the first sample."""
    reading_delay: int = 0
    """Age of the command in force when a reading was taken, in commands: 0 in lockstep, 1 live, more pipelined."""
    rearm_times: int = 0
    """How many faults of wire or device a run survives."""
    rearm_after_s: float = 0.0
    """How long the device is left off before it is armed again [s]."""
    watchdog_s: float = 0.0
    """The device's own watchdog [s]; 0: none."""


@dataclass(slots=True)
class Position:
    """The position in the plan; it outlives a fault."""

    index: int = -1
    """The last sample that was recorded; -1 before the first."""
    setpoint: float = math.nan
    """Setpoint that replaces the plan's [controlled unit]; NaN: none does."""
    acknowledged: Levels | None = None
    """The last command that the device acknowledged [its units]; None: none yet."""


class Sampler:
    """Takes the samples of a plan from rest at the safe levels; what outlives a sample is public."""

    def __init__(
        self, parts: LoopParts, plan: LoopPlan, step: Step, reading: Measurement, safe: Levels, at: Position
    ) -> None:
        """Start estimator and controller.

        Args:
            parts: what the loop calls.
            plan: what the loop does.
            step: estimator, controller and limits.
            reading: the last reading of the settling hold.
            safe: the level of each command in force [its unit].
            at: the position after which the samples are taken; advanced with each.

        Raises:
            DriverError: the first command would exceed a limit.
        """
        self.parts, self.plan, self.step, self.at = parts, plan, step, at
        self.reading = reading
        self.period_s = period_s = plan.period_s
        self.first, self.last = at.index + 1, len(plan.setpoints) - 1
        self.setpoints = plan.setpoints
        self.upcoming = upcoming_setpoints(plan.setpoints, period_s, step.preview_s)
        self._setpoints, self._upcoming = floats(self.setpoints), floats(self.upcoming)
        parts.events.note(self.first, START, sensed=reading.sensed, levels=safe)
        self.sent = deque((plan.reading_delay + 1) * [safe], maxlen=plan.reading_delay + 1)
        setpoint = self._setpoints[self.first] if at.setpoint != at.setpoint else at.setpoint
        self.levels = step.start(safe, setpoint, reading.sensed, period_s)
        parts.energy.refuse_too_much(self.levels, period_s)
        self._record, self._record_timing = parts.signals.append, parts.timings.append
        self._guarded, self._timing, self._changes = parts.guard is not None, parts.timing, parts.changes
        self.repeats = False
        """Whether the present reading is the one before, to the bit."""
        self.contradicted = self._asking_the_model()
        self._wait, self._exchange, self._decide = parts.clock.wait, parts.driver.exchange, step.step
        self._refuse_too_much = parts.energy.refuse_too_much

    def run(self) -> None:
        """Take all samples. Raises DriverError."""
        self.parts.clock.start(self.period_s)
        while self.at.index < self.last and self.take():
            pass

    def take(self) -> bool:
        """Take the next sample; return False if the plan's last ones were missed. Raises DriverError."""
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
        """Take a sample from its exchange on.

        Args:
            index: the sample's index in the plan.
            missed: periods missed before it.
            lateness_s: how late the loop woke up [s].

        Raises:
            DriverError: the exchange failed, or the reading or the next command is refused.
        """
        begun_ns = time.perf_counter_ns()
        new = self._exchange(self.levels)
        self.complete(index, missed, lateness_s, new, begun_ns, time.perf_counter_ns())

    def acknowledge(self, answer: Measurement) -> None:
        """Note the command that an exchange has brought into force, unless the device says that it refused it."""
        if not answer.status & REFUSED:
            self.at.acknowledged = self.levels if self.plan.reading_delay < 2 else self.sent[2]

    def missed(self, periods: int) -> None:
        """Account for `periods` missed before this sample. Raise DriverError if they are too many."""
        self._timing.missed(periods)
        self._refuse_too_much(self.levels, periods * self.period_s)  # the levels were held meanwhile

    def complete(
        self, index: int, missed: int, lateness_s: float, new: Measurement, begun_ns: int, answered_ns: int
    ) -> None:
        """Take a sample from its reading on.

        Args:
            index: the sample's index in the plan.
            missed: periods missed before it.
            lateness_s: how late the loop woke up [s].
            new: the reading.
            begun_ns: host time of the request [ns].
            answered_ns: host time of the answer [ns].

        Raises:
            DriverError: the reading or the next command is refused.
        """
        elapsed_s = (missed + 1) * self.period_s
        self.acknowledge(new)
        refuse_implausible(self.parts, new, self.reading)
        if self._guarded:
            refuse_unlikely(self.parts, new, self.reading, self.levels[0], elapsed_s, begun_ns, answered_ns)
        self.repeats = new.sensed == self.reading.sensed
        self.reading = new
        self.decide(index, elapsed_s, lateness_s, begun_ns, answered_ns)

    def decide(
        self, index: int, elapsed_s: float, lateness_s: float, begun_ns: int, answered_ns: int
    ) -> None:
        """Take a sample from its accepted reading on.

        Args:
            index: the sample's index in the plan.
            elapsed_s: time since the sample before [s].
            lateness_s: how late the loop woke up [s].
            begun_ns: host time of the request [ns].
            answered_ns: host time of the answer [ns].

        Raises:
            DriverError: the next command is refused.
        """
        at, reading, commanded = self.at, self.reading, self.levels
        if self._changes:
            self._apply_change(index)
        setpoint, aimed = self._setpoints[index], self._upcoming[index]
        if at.setpoint == at.setpoint:
            setpoint = aimed = at.setpoint
        self.sent.append(commanded)
        estimate, levels, terms = self._decide(
            setpoint, aimed, self.sent[0], commanded, reading.sensed, elapsed_s
        )
        self.levels = levels
        if self.repeats and self.contradicted is not None:
            self.contradicted.refuse_contradicted(
                self.step.model_reading(), reading.sensed[0], self.step.reading_error
            )
        self._refuse_too_much(levels, self.period_s)
        self.record((index, setpoint, *estimate, reading.reference, *reading.sensed, *commanded, *terms,
                     reading.counter, reading.time_us, reading.status), lateness_s, begun_ns, answered_ns)  # fmt: skip
        at.index = index

    def _apply_change(self, index: int) -> None:
        """Apply one change; one per sample, so that a flood of them delays no sample by more."""
        parts, change = self.parts, self.parts.changes.take()
        if change.name == STOP:
            refuse_stopped(parts)
        try:
            if change.name == SETPOINT:
                self.at.setpoint = change.value
            elif change.name == MODEL:
                self._succeed(index)
                return
            else:
                self.step.change(change.name, change.value)
        except InputError as error:
            parts.changes.refuse(change)
            parts.events.note(index, "refused", name=change.name, value=change.value, message=str(error))
        else:
            parts.events.note(index, "change", name=change.name, value=change.value)

    def _asking_the_model(self) -> ReadingGuard | None:
        """Return the guard if it can ask the step's model whether a reading is stuck; it forgets another one's."""
        guard = self.parts.guard
        if guard is None or guard.rules.frozen_after <= 0 or not math.isfinite(self.step.reading_error):
            return None
        guard.forget_model()
        return guard

    def _succeed(self, index: int) -> None:
        """Let the step of another model decide from sample `index` on; the limits stay. Raises InputError."""
        successor, self.parts.changes.successor = self.parts.changes.successor, None
        if successor is None or successor.since < self.first:
            raise InputError("the device was armed again since this model was prepared; ask for it again")
        if successor.take_over(self.levels) != self.at.index:
            raise InputError("rows of this run are missing, which the model's estimator would have to follow")
        if not successor.knows_all(self.first):
            hand_on(self.step, successor.step)
        self.step, self.upcoming = successor.step, successor.upcoming
        self._upcoming, self._decide = floats(self.upcoming), self.step.step
        self.contradicted = self._asking_the_model()
        told = (
            {} if successor.past is None else {"before": successor.past.number, "until": successor.past.until}
        )
        self.parts.events.note(index, MODEL, number=successor.number, since=successor.since, **told)

    def record(self, row: tuple[float, ...], lateness_s: float, begun_ns: int, answered_ns: int) -> None:
        """Record a sample.

        Args:
            row: its signals (`rtctl.loop.supervisor.signal_columns`).
            lateness_s: how late the loop woke up [s].
            begun_ns: host time of the request [ns].
            answered_ns: host time of the answer [ns].

        Raises:
            DriverError: the recorder failed.
        """
        self._record(row)
        decided_ns = time.perf_counter_ns()
        round_trip_ns, compute_ns = answered_ns - begun_ns, decided_ns - answered_ns
        self._record_timing((lateness_s * 1e6, round_trip_ns * 1e-3, compute_ns * 1e-3))
        self._timing.step(int(lateness_s * 1e9), round_trip_ns, compute_ns)


def floats(values: FloatArray) -> Sequence[float]:
    """Return a view of `values` (n,) whose items are Python floats; a list would take five times the memory."""
    return memoryview(np.ascontiguousarray(values))  # type: ignore[arg-type]


def refuse_implausible(parts: LoopParts, new: Measurement, previous: Measurement) -> None:
    """Raise DriverError for a reading that is implausible by itself, or if the user asked to stop."""
    finding = parts.plausibility.judge(new, previous)
    if finding is not None:
        raise DriverError(*finding)
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
    """Raise DriverError for a reading that does not follow on the one before.

    Args:
        parts: its guard judges, if there is one.
        new: the reading.
        previous: the reading before it.
        level: the first command that `new` answers [its unit].
        elapsed_s: time since `previous` [s].
        begun_ns: host time of the request [ns].
        answered_ns: host time of the answer [ns].
    """
    if parts.guard is not None:
        finding = parts.guard.judge(new, previous, level, elapsed_s, begun_ns, answered_ns)
        if finding is not None:
            raise DriverError(*finding)


def refuse_stopped(parts: LoopParts) -> None:
    """Raise DriverError if the run was asked to end through its channel."""
    if parts.changes.stopped:
        raise DriverError(
            Fault.INTERRUPTED, "stopped from outside (stop); what was recorded until then is written"
        )


def refuse_interrupted(parts: LoopParts) -> None:
    """Raise DriverError if the user asked to stop."""
    if parts.stop_requested():
        raise DriverError(Fault.INTERRUPTED, "stopped by the user; what was recorded until then is written")
