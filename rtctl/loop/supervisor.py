"""Supervision of a run: settle at the safe levels, take the samples, re-arm after a fault, end at the safe levels.

Time passes in three places of this package only: while settling and re-arming here, and between samples in
`rtctl.loop.sampler` and `rtctl.loop.compiled.block`. They wait on the clock that they are given and exchange with the
driver; estimator, controller, limits and guards have no clock.

In lockstep an exchange carries the command u[k], lets the device run one period with it and brings back the reading at
the end of the period; the next command is computed from that reading. Live, the reading of an exchange is from before
its command takes effect: a delay of one period, which the tuning accounts for, and of more where answers are pipelined.
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass

from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceProfile, Measurement, SwitchedOff
from rtctl.interfaces import Column, Controller, Estimator
from rtctl.loop.compiled.support import compiled_sampler
from rtctl.loop.ending import how_left
from rtctl.loop.sampler import (
    REFUSED,
    LoopParts,
    LoopPlan,
    Position,
    Sampler,
    refuse_implausible,
    refuse_interrupted,
    refuse_stopped,
    refuse_unlikely,
)
from rtctl.loop.step import ReadableStep

__all__ = ["FINAL", "TIMING_COLUMNS", "LoopOutcome", "LoopParts", "LoopPlan", "run_loop", "signal_columns"]

FINAL = frozenset(
    {
        Fault.INTERRUPTED,
        Fault.DEADLINES_MISSED,
        Fault.RECORDING,
        Fault.ENERGY_LIMIT,
        Fault.PART_FAILED,
    }
)
"""Faults after which the device is not re-armed: a stop by the user, a fault of this machine or of a part of the
user's, too much energy."""

SAFELY_OFF = (SwitchedOff.OFF, SwitchedOff.SAFE)
"""Answers to being switched off after which a device is at its safe levels; else it may be at the last command."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopOutcome:
    """How a run ended."""

    steps: int
    """Samples taken."""
    overruns: int
    """Periods missed."""
    fault: Fault | None
    """The fault that ended the run; None: it is complete."""
    message: str
    """The explanation of the fault."""
    survived: tuple[tuple[int, Fault, str], ...] = ()
    """Faults after which the device was re-armed: index of the next sample, name, explanation."""
    taken_in: str = ""
    """Where samples were taken: `rtctl.loop.compiled.support.BLOCKS`, or Python and why; "": none was."""


def run_loop(parts: LoopParts, plan: LoopPlan, first: Measurement) -> LoopOutcome:
    """Run the plan on an open driver and close it at the safe levels, whatever happens.

    A fault of wire or device raises nothing: it ends the run and is named in the outcome. If the plan allows, the
    device is re-armed instead: it is left off for a while, opened again and settled at the safe levels; the controller
    starts from there without a bump, and the plan goes on where it was.

    Args:
        parts: what the loop calls.
        plan: what the loop does.
        first: the reading with which the driver was opened.
    """
    safe = tuple(limit.safe for limit in parts.limits)
    step = parts.step or ReadableStep(parts.estimator, parts.controller, parts.limits)
    at = Position()
    survived: list[tuple[int, Fault, str]] = []
    reading: Measurement | None = first
    fault, message, taken_in = None, "", ""
    off: SwitchedOff | None = None
    commanded = safe
    parts.energy.start(safe)
    try:
        while True:
            try:
                if reading is None:
                    parts.energy.hold(safe if off in SAFELY_OFF else commanded, plan.rearm_after_s)
                    reading = _reopened(parts, plan)
                    parts.events.note(at.index + 1, "rearmed")
                refuse_implausible(parts, reading, reading._replace(counter=reading.counter - 1))
                settled = _settle(parts, plan, reading, at)
                if at.index + 1 < len(plan.setpoints):
                    sampler = Sampler(parts, plan, step, settled, safe, at)
                    compiled, taken_in = compiled_sampler(sampler)
                    try:
                        (compiled or sampler).run()
                    finally:
                        step, commanded = sampler.step, sampler.levels  # another step may have taken over
                break
            except DriverError as error:
                was_open, reading = reading is not None, None
                closed = parts.driver.close(safe)
                if (
                    was_open or closed is SwitchedOff.OFF
                ):  # else it was off already, and could not be opened again
                    off = closed
                left = how_left(parts.driver.profile, at.acknowledged, off, plan.watchdog_s)
                fault, message = error.fault, f"{error}; {left}"
                parts.events.note(at.index + 1, "fault", fault=str(fault), message=message)
                if parts.reopen is None or fault in FINAL or len(survived) == plan.rearm_times:
                    break
                survived.append((at.index + 1, fault, message))
                fault, message = None, ""
    finally:  # also on what is no fault: a second Ctrl-C, a bug
        if fault is None:
            _close_at_end(parts, plan, at, safe)
    timing = parts.timing
    return LoopOutcome(
        steps=timing.steps,
        overruns=timing.overruns,
        fault=fault,
        message=message,
        survived=tuple(survived),
        taken_in=taken_in,
    )


def _close_at_end(parts: LoopParts, plan: LoopPlan, at: Position, safe: tuple[float, ...]) -> None:
    """Close the driver, and warn where the device did not acknowledge that it is off."""
    closed = parts.driver.close(safe)
    if closed in (SwitchedOff.SAFE, SwitchedOff.SILENT):
        left = how_left(parts.driver.profile, at.acknowledged, closed, plan.watchdog_s)
        logging.getLogger("rtctl").warning("at the end of the run: %s", left)


def _reopened(parts: LoopParts, plan: LoopPlan) -> Measurement:
    """Leave the device off for a while, then open it; return the first reading. Raises DriverError."""
    parts.clock.start(plan.period_s)
    for _ in range(math.ceil(plan.rearm_after_s / plan.period_s)):
        parts.clock.wait()
        refuse_interrupted(parts)
        refuse_stopped(parts)
    assert parts.reopen is not None
    return parts.reopen()


def _settle(parts: LoopParts, plan: LoopPlan, first: Measurement, at: Position) -> Measurement:
    """Hold the safe levels, from where every model starts; return the last reading. Raises DriverError."""
    reading, safe = first, tuple(limit.safe for limit in parts.limits)
    if parts.guard is not None:
        parts.guard.start()
    parts.clock.start(plan.period_s)
    for _ in range(plan.settle_steps):
        refuse_stopped(parts)
        parts.clock.wait()
        begun_ns = time.perf_counter_ns()
        new = parts.driver.exchange(safe)
        parts.energy.hold(safe, plan.period_s)
        at.acknowledged = at.acknowledged if new.status & REFUSED else safe
        refuse_implausible(parts, new, reading)
        refuse_unlikely(parts, new, reading, safe[0], plan.period_s, begun_ns, time.perf_counter_ns())
        reading = new
    return reading


def signal_columns(profile: DeviceProfile, estimator: Estimator, controller: Controller) -> list[Column]:
    """Return names and units of the recorded signals, in the order in which the loop appends them.

    Raises:
        InputError: the estimator's surrogate or a term of the controller has the name of another signal.
    """
    unit = profile.reference.unit
    columns: list[Column] = [
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
    names = [name for name, _ in columns]
    for part, own in (
        ("surrogate of the estimator", [estimator.surrogate]),
        ("terms of the controller", controller.terms),
    ):
        if twice := sorted({name for name, _ in own if names.count(name) > 1}):
            raise InputError(
                f'{part}: "{twice[0]}" is the name of another recorded signal; name it differently '
                f"(the recording has {', '.join(names)})"
            )
    return columns


TIMING_COLUMNS = [("lateness", "us"), ("round_trip", "us"), ("compute", "us")]
