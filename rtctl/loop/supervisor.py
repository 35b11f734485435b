"""The loop: exchange, estimate, control, limit, command, record. Only here does time pass.

In lockstep an exchange carries the command u[k], lets the device live one period with it and brings back the
reading at the period's end; the next command is computed from that reading. Live, the reading of an exchange is
from before its command takes effect: one period of delay, which the tuning knows, and more where answers are pipelined.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceProfile, Measurement
from rtctl.interfaces import Column, Controller, Estimator
from rtctl.loop.compiled.support import compiled_sampler
from rtctl.loop.sampler import (
    LoopParts,
    LoopPlan,
    Position,
    Sampler,
    refuse_implausible,
    refuse_interrupted,
    refuse_unlikely,
)
from rtctl.loop.step import ReadableStep

__all__ = ["FINAL", "TIMING_COLUMNS", "LoopOutcome", "LoopParts", "LoopPlan", "run_loop", "signal_columns"]

FINAL = frozenset({Fault.INTERRUPTED, Fault.DEADLINES_MISSED, Fault.RECORDING, Fault.ENERGY_LIMIT})
"""Faults that no re-arming mends: the user's own, the machine's, and one that stands for a device's health."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopOutcome:
    """How a run ended. `fault` is None after a whole run."""

    steps: int
    overruns: int
    fault: Fault | None
    message: str
    survived: tuple[tuple[int, Fault, str], ...] = ()
    """Faults after which the device was re-armed: the sample before which they struck, name, sentence."""
    taken_in: str = ""
    """`rtctl.loop.compiled.support.BLOCKS`, or Python, and why; "" where no sample was taken."""


def run_loop(parts: LoopParts, plan: LoopPlan, first: Measurement) -> LoopOutcome:
    """Run the plan on an open driver whose first reading is `first`; always ends at the safe levels.

    Raises nothing for faults of wire or device: they end the run and are named in the outcome. Where the plan allows
    it the device is re-armed instead: off for a while, opened again, settled at the safe levels, and the controller
    starts from there without a bump; the plan goes on where it was.
    """
    safe = tuple(limit.safe for limit in parts.limits)
    step = parts.step or ReadableStep(parts.estimator, parts.controller, parts.limits)
    at = Position()
    survived: list[tuple[int, Fault, str]] = []
    reading: Measurement | None = first
    fault, message, taken_in = None, "", ""
    try:
        while True:
            try:
                if reading is None:
                    reading = _reopened(parts, plan)
                    parts.events.note(at.index + 1, "rearmed")
                refuse_implausible(parts, reading, reading._replace(counter=reading.counter - 1))
                settled = _settle(parts, plan, reading, safe)
                if at.index + 1 < len(plan.setpoints):
                    sampler = Sampler(parts, plan, step, settled, safe, at)
                    compiled, taken_in = compiled_sampler(sampler)
                    (compiled or sampler).run()
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
        steps=timing.steps,
        overruns=timing.overruns,
        fault=fault,
        message=message,
        survived=tuple(survived),
        taken_in=taken_in,
    )


def _reopened(parts: LoopParts, plan: LoopPlan) -> Measurement:
    """The device left off for a while, then armed. Raises DriverError."""
    parts.clock.start(plan.period_s)
    for _ in range(math.ceil(plan.rearm_after_s / plan.period_s)):
        parts.clock.wait()
        refuse_interrupted(parts)
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
        refuse_implausible(parts, new, reading)
        refuse_unlikely(parts, new, reading, safe[0], plan.period_s, begun_ns, time.perf_counter_ns())
        reading = new
    return reading


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
