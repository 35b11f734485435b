"""The loop: exchange, estimate, control, limit, command, record. Only here does time pass.

In lockstep an exchange carries the command u[k], lets the device live one period with it and brings back the
reading at the period's end; the next command is computed from that reading. Live, the reading of an exchange is
from before its command takes effect: one period of delay, which the tuning knows, and more where answers are pipelined.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceProfile, Driver, Measurement
from rtctl.events import Events
from rtctl.guards import EnergyGuard, ReadingGuard
from rtctl.interfaces import Clock, Column, Controller, Estimator, SignalRecorder
from rtctl.limits import CommandLimits, Plausibility
from rtctl.parameters import SETPOINT, ParameterChannel
from rtctl.step import Levels, ReadableStep, Step, upcoming_setpoints
from rtctl.step_timing import StepTiming

FINAL = frozenset({Fault.INTERRUPTED, Fault.DEADLINES_MISSED, Fault.RECORDING, Fault.ENERGY_LIMIT})
"""Faults that no re-arming mends: the user's own, the machine's, and one that stands for a device's health."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopOutcome:
    """How a run ended. `fault` is None after a whole run."""

    steps: int
    overruns: int
    fault: Fault | None
    message: str
    survived: tuple[tuple[int, Fault, str], ...] = ()
    """Faults after which the device was re-armed: the sample before which they struck, name, sentence."""


def run_loop(parts: LoopParts, plan: LoopPlan, first: Measurement) -> LoopOutcome:
    """Run the plan on an open driver whose first reading is `first`; always ends at the safe levels.

    Raises nothing for faults of wire or device: they end the run and are named in the outcome. Where the plan allows
    it the device is re-armed instead: off for a while, opened again, settled at the safe levels, and the controller
    starts from there without a bump; the plan goes on where it was.
    """
    safe = tuple(limit.safe for limit in parts.limits)
    step = parts.step or ReadableStep(parts.estimator, parts.controller, parts.limits)
    at = _Position()
    survived: list[tuple[int, Fault, str]] = []
    reading: Measurement | None = first
    fault, message = None, ""
    try:
        while True:
            try:
                if reading is None:
                    reading = _reopened(parts, plan)
                    parts.events.note(at.index + 1, "rearmed")
                _refuse_implausible(parts, reading, reading._replace(counter=reading.counter - 1))
                settled = _settle(parts, plan, reading, safe)
                _track(parts, plan, step, settled, safe, at)
                break
            except DriverError as error:
                fault, message, reading = error.fault, str(error), None
                parts.driver.close(safe)
                parts.events.note(at.index + 1, "fault", fault=str(fault), message=message)
                if parts.reopen is None or fault in FINAL or len(survived) == plan.rearm_times:
                    break
                survived.append((at.index + 1, fault, message))
                fault, message = None, ""
    finally:  # also on what is no fault: a second Ctrl-C, a bug
        if fault is None:
            parts.driver.close(safe)
    timing = parts.timing
    return LoopOutcome(
        steps=timing.steps, overruns=timing.overruns, fault=fault, message=message, survived=tuple(survived)
    )


@dataclass(slots=True)
class _Position:
    """The last sample that was recorded; -1 before the first. It outlives a fault."""

    index: int = -1
    setpoint: float = math.nan
    """What somebody set instead of the plan's; NaN: nothing."""


def _reopened(parts: LoopParts, plan: LoopPlan) -> Measurement:
    """The device left off for a while, then armed. Raises DriverError."""
    parts.clock.start(plan.period_s)
    for _ in range(math.ceil(plan.rearm_after_s / plan.period_s)):
        parts.clock.wait()
        _refuse_interrupted(parts)
    assert parts.reopen is not None
    return parts.reopen()


def _settle(parts: LoopParts, plan: LoopPlan, first: Measurement, safe: Sequence[float]) -> Measurement:
    """Rest at the safe levels: every model starts where this leaves the plant."""
    reading = first
    if parts.guard is not None:
        parts.guard.start()
    parts.energy.start(safe)
    parts.clock.start(plan.period_s)
    for _ in range(plan.settle_steps):
        parts.clock.wait()
        begun_ns = time.perf_counter_ns()
        new = parts.driver.exchange(safe)
        _refuse_implausible(parts, new, reading)
        _refuse_unlikely(parts, new, reading, safe[0], plan.period_s, begun_ns, time.perf_counter_ns())
        reading = new
    return reading


def _track(
    parts: LoopParts, plan: LoopPlan, step: Step, reading: Measurement, safe: Levels, at: _Position
) -> None:
    """From the sample after `at` to the last one, from rest at the safe levels."""
    period_s = plan.period_s
    first, last = at.index + 1, len(plan.setpoints) - 1
    if first > last:
        return
    setpoints, upcoming = (
        floats(plan.setpoints),
        floats(upcoming_setpoints(plan.setpoints, period_s, step.preview_s)),
    )
    parts.events.note(first, "start", sensed=reading.sensed, levels=safe)
    sent = deque((plan.reading_delay + 1) * [safe], maxlen=plan.reading_delay + 1)
    beginning = setpoints[first] if at.setpoint != at.setpoint else at.setpoint
    levels = step.start(safe, beginning, reading.sensed, period_s)
    parts.energy.refuse_too_much(levels, period_s)
    wait, exchange, decide, timing, changes = (
        parts.clock.wait, parts.driver.exchange, step.step, parts.timing, parts.changes
    )  # fmt: skip
    record, record_timing, now_ns = parts.signals.append, parts.timings.append, time.perf_counter_ns
    guarded, refuse_too_much = parts.guard is not None, parts.energy.refuse_too_much
    parts.clock.start(period_s)
    while at.index < last:
        tick, lateness_s = wait()
        index = first + tick
        missed = index - at.index - 1
        if index > last:
            timing.overruns += last - at.index
            break
        if missed:
            timing.missed(missed)
            refuse_too_much(levels, missed * period_s)  # they were held meanwhile
        begun_ns = now_ns()
        new = exchange(levels)
        answered_ns = now_ns()
        _refuse_implausible(parts, new, reading)
        elapsed_s = (missed + 1) * period_s
        if guarded:
            _refuse_unlikely(parts, new, reading, levels[0], elapsed_s, begun_ns, answered_ns)
        reading = new
        if changes:
            _change(parts, step, index, at)
        setpoint, aimed = setpoints[index], upcoming[index]
        if at.setpoint == at.setpoint:
            setpoint = aimed = at.setpoint
        sent.append(levels)
        commanded = levels
        estimate, levels, terms = decide(setpoint, aimed, sent[0], levels, reading.sensed, elapsed_s)
        refuse_too_much(levels, period_s)
        record((index, setpoint, *estimate, reading.reference, *reading.sensed, *commanded, *terms,
                reading.counter, reading.time_us, reading.status))  # fmt: skip
        decided_ns = now_ns()
        round_trip_ns, compute_ns = answered_ns - begun_ns, decided_ns - answered_ns
        record_timing((lateness_s * 1e6, round_trip_ns * 1e-3, compute_ns * 1e-3))
        timing.step(int(lateness_s * 1e9), round_trip_ns, compute_ns)
        at.index = index


def floats(values: NDArray[np.float64]) -> Sequence[float]:
    """A view whose items are Python's floats; a list of them would be five times as large."""
    return memoryview(np.ascontiguousarray(values))  # type: ignore[arg-type]


def _change(parts: LoopParts, step: Step, index: int, at: _Position) -> None:
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


def _refuse_implausible(parts: LoopParts, new: Measurement, previous: Measurement) -> None:
    """Raise DriverError for a reading that must not be controlled on, or when the user asked to stop."""
    found = parts.plausibility.judge(new, previous)
    if found is not None:
        raise DriverError(*found)
    _refuse_interrupted(parts)


def _refuse_unlikely(
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


def _refuse_interrupted(parts: LoopParts) -> None:
    if parts.stop_requested():
        raise DriverError(Fault.INTERRUPTED, "stopped by the user; what was recorded until then is written")


def signal_columns(profile: DeviceProfile, estimator: Estimator, controller: Controller) -> list[Column]:
    """Names and units of the recorded signals, in the order in which the loop appends them."""
    unit = profile.reference.unit
    return [
        ("index", ""),
        ("setpoint", unit),
        ("estimate", unit),
        estimator.surrogate,
        ("estimate_standard_error", unit),
        ("estimate_status", ""),
        (profile.reference.name, unit),
        *((channel.name, channel.unit) for channel in profile.sensed),
        *((channel.name, channel.unit) for channel in profile.commands),
        *controller.terms,
        ("counter", ""),
        ("device_time", "us"),
        ("device_status", ""),
    ]


TIMING_COLUMNS = [("lateness", "us"), ("round_trip", "us"), ("compute", "us")]
