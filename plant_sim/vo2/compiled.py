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
from plant_sim.vo2.plant import STATE, hold_domains, hold_limiting_loop, read
from rtctl.border.arrays import IntArray
from rtctl.border.compiled_clock import clock_ns
from rtctl.border.kernels import background_kernel, carray, pointer
from rtctl.border.records import DeviceStatus
from rtctl.border.wire_memory import CLOCK, COUNTER, IN_FORCE, OK, PYTHON, SEQUENCE, STATUS, TIME_US

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
    """Free-running: whole microseconds since the device's time began."""
    now_s = clock_ns(line, CLOCK) / 1e9
    return int(np.rint((now_s - line.view(np.float64)[EPOCH_S]) * 1e6))


@background_kernel
def later_us(line: IntArray) -> int:
    """The same, after the last reading's: a loop may ask again within a microsecond, and no two readings are of one."""
    now_us = device_us(line)
    while now_us <= line[NOW_US]:
        now_us = device_us(line)
    return now_us


@background_kernel
def is_ordinary(line: IntArray, asked: float, now_us: int) -> bool:
    """Whether Python has no say in this exchange."""
    if not math.isfinite(asked) or line[ROW] + 1 >= line[ROWS]:
        return False
    if line[HEALTH] & (_ENABLED | _TRIPPED) != _ENABLED or (line[SEQUENCE] + 1) & 0xFFFF == line[NUMBER]:
        return False
    if line[LOCKSTEP] != 0:
        return not 0 < line[WATCHDOG_US] < line[PERIOD_US]
    leased: bool = now_us <= line[FED_US] + line[WATCHDOG_US]
    return leased or line[FED_US] == NONE or line[WATCHDOG_US] == 0


@background_kernel
def commanded(line: IntArray, asked: float) -> float:
    """The command within the device's limits, in force from now on; status and watchdog know of it."""
    floats = line.view(np.float64)
    level: float = min(max(asked, floats[LOW]), floats[HIGH])
    floats[LEVEL] = level
    line[HEALTH] = _ENABLED | (_CLAMPED if level != asked else 0) | (line[HEALTH] & _SENSOR_FAULT)
    line[SEQUENCE] = (line[SEQUENCE] + 1) & 0xFFFF
    line[NUMBER] = line[SEQUENCE]
    line[FED_US] = line[NOW_US]
    return level


@background_kernel
def answered(line: IntArray, reading: Any, sensed: float, reference: float) -> int:
    """A reading, as float32, and all that stands beside it."""
    reading[0], reading[1] = np.float64(np.float32(sensed)), np.float64(np.float32(reference))
    line[COUNT] += 1
    line[HEALTH] &= ~_SENSOR_FAULT
    if not math.isfinite(reading[0]):
        line[HEALTH] |= _SENSOR_FAULT
    line[COUNTER], line[TIME_US] = line[COUNT] & _UINT32, line[NOW_US] & _UINT32
    line[IN_FORCE], line[STATUS] = line[NUMBER], line[HEALTH]
    return OK


@background_kernel
def since_last(line: IntArray, now_us: int) -> float:
    """How long the level in force was held until now [s]; the device's time goes on."""
    held_s: float = 1e-6 * max(now_us - line[NOW_US], 0)
    line[NOW_US] = max(line[NOW_US], now_us)
    return held_s


@background_kernel
def exchange_with_domains(
    levels: Any, reading: Any, line: IntArray, p: Any, state: Any, normals: Any,
    t_up: Any, t_down: Any, by_t_down: Any, is_up: Any, counters: Any,
) -> int:  # fmt: skip
    """`SimulatedDevice.exchange` around a film of domains."""
    asked = np.float64(np.float32(levels[0]))
    lockstep = line[LOCKSTEP] != 0
    now_us = 0 if lockstep else later_us(line)
    if not is_ordinary(line, asked, now_us):
        return PYTHON
    floats = line.view(np.float64)
    if not lockstep and now_us > line[NOW_US]:
        hold_domains(
            p, state, floats[LEVEL], since_last(line, now_us), t_up, t_down, by_t_down, is_up, counters
        )
    level = commanded(line, asked)
    now_us = line[NOW_US] + line[PERIOD_US] if lockstep else device_us(line)
    if now_us > line[NOW_US]:
        hold_domains(p, state, level, since_last(line, now_us), t_up, t_down, by_t_down, is_up, counters)
    line[ROW] += 1
    sensed, reference = read(p, state, normals, line[ROW])
    return answered(line, reading, sensed, reference)


@background_kernel
def exchange_with_limiting_loops(
    levels: Any, reading: Any, line: IntArray, p: Any, state: Any, normals: Any, memory: Any
) -> int:
    """`SimulatedDevice.exchange` around a film that follows limiting loops."""
    asked = np.float64(np.float32(levels[0]))
    lockstep = line[LOCKSTEP] != 0
    now_us = 0 if lockstep else later_us(line)
    if not is_ordinary(line, asked, now_us):
        return PYTHON
    floats = line.view(np.float64)
    if not lockstep and now_us > line[NOW_US]:
        hold_limiting_loop(p, state, floats[LEVEL], since_last(line, now_us), memory)
    level = commanded(line, asked)
    now_us = line[NOW_US] + line[PERIOD_US] if lockstep else device_us(line)
    if now_us > line[NOW_US]:
        hold_limiting_loop(p, state, level, since_last(line, now_us), memory)
    line[ROW] += 1
    sensed, reference = read(p, state, normals, line[ROW])
    return answered(line, reading, sensed, reference)


@lru_cache
def exchange_of(parameters: np.dtype[Any], *, limiting: bool) -> Callable[..., int]:
    """The kernel of films of one kind, whose parameters are laid out so; nothing but the layout is bound to it."""

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
