"""The loop: exchange, estimate, control, limit, command, record. Only here does time pass.

In lockstep an exchange carries the command u[k], lets the device live one period with it and brings back the
reading at the period's end; the next command is computed from that reading. Live, the reading of an exchange is
from before its command takes effect: one period of delay, which the tuning knows, and more where answers are pipelined.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceProfile, Driver, Measurement
from rtctl.interfaces import (
    Clock,
    Column,
    ControlAction,
    Controller,
    Estimate,
    Estimator,
    SignalRecorder,
)
from rtctl.limits import CommandLimits, Plausibility


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


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopPlan:
    """What a run does: the setpoint of each sample [controlled unit] after a settling hold at the safe levels."""

    period_s: float
    setpoints: NDArray[np.float64]
    settle_steps: int
    reading_delay: int = 0
    """Commands back to the one that was applied when a reading was taken: 0 in lockstep, 1 live, more pipelined."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopOutcome:
    """How a run ended. `fault` is None after a whole run."""

    steps: int
    overruns: int
    fault: Fault | None
    message: str


def run_loop(parts: LoopParts, plan: LoopPlan, first: Measurement) -> LoopOutcome:
    """Run the plan on an open driver whose first reading is `first`; always ends at the safe levels.

    Raises nothing for faults of wire or device: they end the run and are named in the outcome.
    """
    safe = tuple(limit.safe for limit in parts.limits)
    progress = _Progress()
    try:
        _refuse_implausible(parts, first, first._replace(counter=first.counter - 1))  # nothing before it
        reading = _settle(parts, plan, first, safe)
        _track(parts, plan, reading, safe, progress)
        fault, message = None, ""
    except DriverError as error:
        fault, message = error.fault, str(error)
    finally:  # also on what is no fault: a second Ctrl-C, a bug
        parts.driver.close(safe)
    return LoopOutcome(steps=progress.steps, overruns=progress.overruns, fault=fault, message=message)


@dataclass(slots=True)
class _Progress:
    steps: int = 0
    overruns: int = 0


def _settle(parts: LoopParts, plan: LoopPlan, first: Measurement, safe: Sequence[float]) -> Measurement:
    """Rest at the safe levels: every model starts where this leaves the plant."""
    reading = first
    parts.clock.start(plan.period_s)
    for _ in range(plan.settle_steps):
        parts.clock.wait()
        reading = _checked_exchange(parts, safe, reading)
    return reading


def _track(
    parts: LoopParts, plan: LoopPlan, reading: Measurement, safe: tuple[float, ...], progress: _Progress
) -> None:
    levels = safe
    sent = deque((plan.reading_delay + 1) * [safe], maxlen=plan.reading_delay + 1)
    setpoints = [*plan.setpoints.tolist(), plan.setpoints[-1].item()]  # after the last one: the same
    estimate = parts.estimator.start(levels, reading.sensed)
    parts.controller.start(levels, setpoints[0], estimate)
    levels = _next_levels(parts, setpoints[0], setpoints[0], estimate, levels, plan.period_s)[0]
    wait, exchange, step_estimator = parts.clock.wait, parts.driver.exchange, parts.estimator.step
    record, record_timing, now_ns = parts.signals.append, parts.timings.append, time.perf_counter_ns
    last, previous_index = len(plan.setpoints) - 1, -1
    parts.clock.start(plan.period_s)
    while previous_index < last:
        index, lateness_s = wait()
        if index > last:
            progress.overruns += last - previous_index
            break
        begun_ns = now_ns()
        new = exchange(levels)
        answered_ns = now_ns()
        _refuse_implausible(parts, new, reading)
        reading = new
        elapsed_s = (index - previous_index) * plan.period_s
        sent.append(levels)
        estimate = step_estimator(sent[0], reading.sensed, elapsed_s)
        setpoint, commanded = setpoints[index], levels
        levels, action = _next_levels(parts, setpoint, setpoints[index + 1], estimate, levels, elapsed_s)
        record((index, setpoint, *estimate, reading.reference, *reading.sensed, *commanded, *action.terms,
                reading.counter, reading.time_us, reading.status))  # fmt: skip
        decided_ns = now_ns()
        record_timing((lateness_s * 1e6, (answered_ns - begun_ns) * 1e-3, (decided_ns - answered_ns) * 1e-3))
        progress.steps += 1
        progress.overruns += index - previous_index - 1
        previous_index = index


def _next_levels(
    parts: LoopParts,
    setpoint: float,
    upcoming: float,
    estimate: Estimate,
    levels: tuple[float, ...],
    elapsed_s: float,
) -> tuple[tuple[float, ...], ControlAction]:
    """Control, then limit; the controller learns what was let through. Raises DriverError on a NaN."""
    action = parts.controller.step(setpoint, upcoming, estimate, elapsed_s)
    asked = action.levels
    if len(asked) == 1:
        allowed: tuple[float, ...] = (parts.limits[0].clip(asked[0], levels[0], elapsed_s),)
    else:
        allowed = tuple(
            limit.clip(level, old, elapsed_s)
            for limit, level, old in zip(parts.limits, asked, levels, strict=True)
        )
    parts.controller.applied(allowed)
    return allowed, action


def _checked_exchange(parts: LoopParts, levels: Sequence[float], previous: Measurement) -> Measurement:
    new = parts.driver.exchange(levels)
    _refuse_implausible(parts, new, previous)
    return new


def _refuse_implausible(parts: LoopParts, new: Measurement, previous: Measurement) -> None:
    """Raise DriverError for a reading that must not be controlled on, or when the user asked to stop."""
    found = parts.plausibility.judge(new, previous)
    if found is not None:
        raise DriverError(*found)
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
