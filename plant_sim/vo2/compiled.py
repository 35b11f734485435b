"""An exchange with a VO2 device in this process as one compiled call: `SimulatedDevice` around `Vo2Plant`, to the bit.

What is not an ordinary exchange is left to Python (`PYTHON`, and nothing has changed): a refusal, a watchdog that has
run out, a used-up block of noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from plant_sim.compiled_device import (
    ADDRESSES,
    COUNT,
    EPOCH_S,
    FED_US,
    HEALTH,
    HIGH,
    LEVEL,
    LOCKSTEP,
    LOW,
    NONE,
    NOW_US,
    NUMBER,
    PERIOD_US,
    RELAYS,
    ROW,
    ROWS,
    WATCHDOG_US,
)
from plant_sim.sensing import NORMALS
from plant_sim.vo2.holds import STATE, hold_domains, hold_limiting_loop, read
from rtctl.border.arrays import IntArray
from rtctl.border.kernels import background_kernel, carray, pointer
from rtctl.border.records import DeviceStatus
from rtctl.border.wire.compiled_clock import clock_ns
from rtctl.border.wire.wire_memory import CLOCK, COUNTER, IN_FORCE, OK, PYTHON, SEQUENCE, STATUS, TIME_US

_ENABLED, _TRIPPED, _CLAMPED, _SENSOR_FAULT = (
    int(DeviceStatus.ENABLED),
    int(DeviceStatus.WATCHDOG_TRIPPED),
    int(DeviceStatus.CLAMPED),
    int(DeviceStatus.SENSOR_FAULT),
)
_UINT32 = 0xFFFFFFFF
_LOOP_MEMORY = 5
"""Numbers of a limiting loop's memory (`plant_sim.vo2.limiting_loop`)."""


@background_kernel
def device_us(line: IntArray) -> int:
    """Return the device's time on a free-running clock: whole microseconds since it started."""
    now_s = clock_ns(line, CLOCK) / 1e9
    return int(np.rint((now_s - line.view(np.float64)[EPOCH_S]) * 1e6))


@background_kernel
def later_us(line: IntArray) -> int:
    """Return `device_us` once it is after that of the last reading: a loop may ask again within a microsecond."""
    now_us = device_us(line)
    while now_us <= line[NOW_US]:
        now_us = device_us(line)
    return now_us


@background_kernel
def is_ordinary(line: IntArray, asked: float, now_us: int) -> bool:
    """Return whether an exchange needs no decision by Python.

    Args:
        line: the line's numbers and the device's.
        asked: the level [mA] of the command.
        now_us: the device's time [us]; not used in lockstep.
    """
    if not math.isfinite(asked) or line[ROW] + 1 >= line[ROWS]:
        return False
    if line[HEALTH] & (_ENABLED | _TRIPPED) != _ENABLED or (line[SEQUENCE] + 1) & 0xFFFF == line[NUMBER]:
        return False
    if line[LOCKSTEP] != 0:
        return not 0 < line[WATCHDOG_US] < line[PERIOD_US]
    leased: bool = now_us <= line[FED_US] + line[WATCHDOG_US]
    return leased or line[FED_US] == NONE or line[WATCHDOG_US] == 0


@background_kernel
def advance_time(line: IntArray, now_us: int) -> float:
    """Advance the device's time to `now_us` [us]; return how long the level in force was held meanwhile [s]."""
    held_s: float = 1e-6 * max(now_us - line[NOW_US], 0)
    line[NOW_US] = max(line[NOW_US], now_us)
    return held_s


@background_kernel
def begin_exchange(line: IntArray, asked: float) -> float:
    """Return how long the level in force was held until the command `asked` [mA] came [s].

    NaN if the exchange is one for Python; nothing has changed then.
    """
    lockstep = line[LOCKSTEP] != 0
    now_us = 0 if lockstep else later_us(line)
    if not is_ordinary(line, asked, now_us):
        return math.nan
    return 0.0 if lockstep else advance_time(line, now_us)


@background_kernel
def accept_command(line: IntArray, asked: float) -> float:
    """Put the command `asked` [mA] in force, within the device's limits; return the time until its reading [s]."""
    floats = line.view(np.float64)
    level: float = min(max(asked, floats[LOW]), floats[HIGH])
    floats[LEVEL] = level
    line[HEALTH] = _ENABLED | (_CLAMPED if level != asked else 0) | (line[HEALTH] & _SENSOR_FAULT)
    line[SEQUENCE] = (line[SEQUENCE] + 1) & 0xFFFF
    line[NUMBER] = line[SEQUENCE]
    line[FED_US] = line[NOW_US]
    return advance_time(line, line[NOW_US] + line[PERIOD_US] if line[LOCKSTEP] != 0 else device_us(line))


@background_kernel
def end_exchange(reading: Any, line: IntArray, p: Any, state: Any, normals: Any) -> int:
    """Read the instruments as float32, with counter, time, number and status beside; return `OK`.

    Args:
        reading: (2,) resistance [ohm] and deflection [um], out.
        line: the line's numbers and the device's.
        p: (1,) parameters of the plant.
        state: (1,) state of the plant.
        normals: block of the noise.
    """
    line[ROW] += 1
    sensed, reference = read(p, state, normals, line[ROW])
    reading[0], reading[1] = np.float64(np.float32(sensed)), np.float64(np.float32(reference))
    line[COUNT] += 1
    line[HEALTH] &= ~_SENSOR_FAULT
    if not math.isfinite(reading[0]):
        line[HEALTH] |= _SENSOR_FAULT
    line[COUNTER], line[TIME_US] = line[COUNT] & _UINT32, line[NOW_US] & _UINT32
    line[IN_FORCE], line[STATUS] = line[NUMBER], line[HEALTH]
    return OK


# 11 parameters because a kernel takes its arrays one by one; the two exchanges differ in `hold` alone, which a kernel
# kept on disk cannot take as an argument
@background_kernel
def exchange_with_domains(  # noqa: PLR0913
    levels: Any, reading: Any, line: IntArray, p: Any, state: Any, normals: Any,
    t_up: Any, t_down: Any, by_t_down: Any, is_up: Any, counters: Any,
) -> int:  # fmt: skip
    """Exchange as `SimulatedDevice` does, with a film of domains; return a code of `wire_memory.Ended`."""
    asked = np.float64(np.float32(levels[0]))
    floats, held_s = line.view(np.float64), begin_exchange(line, asked)
    if not held_s >= 0.0:
        return PYTHON
    if held_s > 0.0:
        hold_domains(p, state, floats[LEVEL], held_s, t_up, t_down, by_t_down, is_up, counters)
    held_s = accept_command(line, asked)
    if held_s > 0.0:
        hold_domains(p, state, floats[LEVEL], held_s, t_up, t_down, by_t_down, is_up, counters)
    return end_exchange(reading, line, p, state, normals)


@background_kernel
def exchange_with_limiting_loops(
    levels: Any, reading: Any, line: IntArray, p: Any, state: Any, normals: Any, memory: Any
) -> int:
    """Exchange as `SimulatedDevice` does, with a film that follows limiting loops; see `exchange_with_domains`."""
    asked = np.float64(np.float32(levels[0]))
    floats, held_s = line.view(np.float64), begin_exchange(line, asked)
    if not held_s >= 0.0:
        return PYTHON
    if held_s > 0.0:
        hold_limiting_loop(p, state, floats[LEVEL], held_s, memory)
    held_s = accept_command(line, asked)
    if held_s > 0.0:
        hold_limiting_loop(p, state, floats[LEVEL], held_s, memory)
    return end_exchange(reading, line, p, state, normals)


@lru_cache
def exchange_of(parameters: np.dtype[Any], *, limiting: bool) -> Callable[..., int]:
    """Return the exchange of a kind of film; only the layout of its `parameters` is bound to it."""

    def with_domains(levels: Any, reading: Any, line: IntArray, out: Any, inbox: Any) -> int:
        n = line[RELAYS]
        return exchange_with_domains(
            levels,
            reading,
            line,
            carray(pointer(line[ADDRESSES]), (1,), parameters),
            carray(pointer(line[ADDRESSES + 1]), (1,), STATE),
            carray(pointer(line[ADDRESSES + 2]), (line[ROWS], NORMALS), np.float64),
            carray(pointer(line[ADDRESSES + 3]), (2, n), np.float64),
            carray(pointer(line[ADDRESSES + 4]), (2, n), np.float64),
            carray(pointer(line[ADDRESSES + 5]), (2, n), np.int64),
            carray(pointer(line[ADDRESSES + 6]), (2, n), np.bool_),
            carray(pointer(line[ADDRESSES + 7]), (2, 3), np.int64),
        )

    def with_limiting_loops(levels: Any, reading: Any, line: IntArray, out: Any, inbox: Any) -> int:
        return exchange_with_limiting_loops(
            levels,
            reading,
            line,
            carray(pointer(line[ADDRESSES]), (1,), parameters),
            carray(pointer(line[ADDRESSES + 1]), (1,), STATE),
            carray(pointer(line[ADDRESSES + 2]), (line[ROWS], NORMALS), np.float64),
            carray(pointer(line[ADDRESSES + 3]), (2, _LOOP_MEMORY), np.float64),
        )

    return background_kernel(with_limiting_loops if limiting else with_domains)
