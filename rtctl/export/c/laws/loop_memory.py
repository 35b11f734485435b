"""Memory of the loop around estimator and controller: levels, readings, limits of power, guards with their rules."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.border.records import DeviceProfile
from rtctl.export.c.laws.law import nth
from rtctl.safety.guards import ReadingGuard, ReadingRules
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility
from rtctl.translation.memory import Memory

NO_RULES = ReadingRules(names=("",), rates=(math.inf,))


class Parts(NamedTuple):
    """The parts of a loop that is exported."""

    profile: DeviceProfile
    estimator: Any
    controller: Any
    limits: tuple[CommandLimits, ...]
    plausibility: Plausibility
    guard: ReadingGuard | None
    period_s: float
    settle_steps: int
    delay: int


class Rules(NamedTuple):
    """Times and levels of the loop."""

    period_s: float
    """Sample period [s]."""
    safe: float
    """The level at which the device is at rest [its unit]."""


class Limits(NamedTuple):
    """Limits of a command, in its unit."""

    low: float
    high: float
    slew_per_s: float


def limits_of(limits: CommandLimits) -> Limits:
    """Return the range and the slew of a command."""
    return Limits(float(limits.low), float(limits.high), float(limits.slew_per_s))


def refuse_stops(limits: Sequence[CommandLimits]) -> None:
    """Raise InputError where a limit stops the loop."""
    if any(one.stop for one in limits):
        raise InputError(
            "export c: limits.stop = true cannot be exported: the exported loop limits, it does not stop"
        )


def loop_memory(parts: Parts) -> list[Memory]:
    """Return the memory of a loop; fields of a second command or reading end in _2."""
    first, guard = parts.limits[0], parts.guard
    memory = [
        Memory("known", 0, "1: there is a reading before"),
        Memory("settle_left", parts.settle_steps + 1, "readings at the safe level before the loop closes"),
        Memory("fault", 0, "the first fault; 0: none"),
    ]
    for k, (channel, limit) in enumerate(zip(parts.profile.commands, parts.limits, strict=True)):
        unit = f"[{channel.unit}]"
        sent = np.full(parts.delay + 1, limit.safe)
        memory += [
            Memory(nth("level", k), limit.safe, f"the {channel.name} that was commanded last {unit}"),
            Memory(nth("sent", k), sent, f"those before it, the oldest first {unit}"),
        ]
    unit = f"[{parts.profile.commands[0].unit}^2]"
    most = first.rms * first.rms if math.isfinite(first.rms) else math.inf
    memory += [
        Memory("mean_square", first.safe * first.safe, f"of the command {unit}"),
        Memory("rms_squared", most, f"its limit {unit}"),
        Memory("rms_window_s", first.rms_window_s, "time constant of the mean [s]"),
    ]
    for k, channel in enumerate(parts.profile.sensed):
        unit = f"[{channel.unit}]"
        rate = math.inf if guard is None else guard.rules.rates[k]
        memory += [
            Memory(nth("sensed", k), 0.0, f"the reading before {unit}"),
            Memory(nth("sensed_low", k), parts.plausibility.sensed_low[k], f"plausible readings {unit}"),
            Memory(nth("sensed_high", k), parts.plausibility.sensed_high[k]),
            Memory(nth("rate", k), rate, f"its largest change {unit[:-1]}/s]"),
        ]
    memory += [
        Memory("counter", np.int64(0), "its sample counter"),
        Memory("time_us", np.int64(0), "its time on the device's clock [us]"),
        Memory("begun_ns", np.int64(0), "the request of this reading [ns]"),
        Memory("answered_ns", np.int64(0), "and its answer [ns]"),
        Memory("elapsed_s", 0.0, "time since the reading before [s]"),
        Memory("guarded", 0 if guard is None else 1, "1: readings are held to those before them"),
    ]
    found = (guard or ReadingGuard(NO_RULES)).memory
    for name in found.dtype.names or ():
        value = found[name][0]
        memory.append(Memory(name, np.int64(value) if found.dtype[name].kind == "i" else float(value)))
    return memory
