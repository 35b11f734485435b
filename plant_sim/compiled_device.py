"""A simulated device in blocks of compiled exchanges: its state and its plant's, lent to a block and taken back.

The kernel of a plant (`plant_sim.vo2.compiled`) finds both behind the line's own numbers: this module's slots, then the
addresses of the plant's arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from plant_sim.sensing import NoiseSource
from rtctl.border.kernels import first_class
from rtctl.border.records import VO2, Measurement
from rtctl.border.wire.wire_memory import (
    COUNTER,
    IN_FORCE,
    LINE_SIZE,
    OK,
    STATUS,
    TIME_US,
    CompiledExchange,
    WireMemory,
    wire_memory,
)

LEVEL, LOW, HIGH, EPOCH_S = range(LINE_SIZE, LINE_SIZE + 4)
"""Slots of float64: the level in force and its limits [mA], when the device's time started [s]."""
HEALTH, NUMBER, COUNT, NOW_US, FED_US, WATCHDOG_US, LOCKSTEP, PERIOD_US, ROW, ROWS, RELAYS = range(
    LINE_SIZE + 4, LINE_SIZE + 15
)
"""Slots of the device's other numbers.

Status, number in force, sample counter, device time [us], when a command last fed the watchdog (-1: it sleeps), the
watchdog's time [us], lockstep, its sample period [us], the last row of noise, rows of a block of it, relays of a bank.
"""
ADDRESSES = LINE_SIZE + 16
MOST_ARRAYS = 8
SIZE = ADDRESSES + MOST_ARRAYS
NONE = -1


class DeviceMemory(NamedTuple):
    """The state of a device with one command."""

    level: float
    low: float
    high: float
    epoch_s: float
    status: int
    sequence: int | None
    counter: int
    time_us: int
    fed_us: int | None
    watchdog_us: int
    lockstep: bool
    period_us: int
    sensed: tuple[float, ...] | None
    reference: float


class CompiledPlant(NamedTuple):
    """The part of a plant in a compiled exchange."""

    kernel: Callable[..., int]
    """Kernel that exchanges with the whole device."""
    arrays: Callable[[], tuple[NDArray[Any], ...]]
    """Returns the arrays that it uses: parameters, state, noise, the film's memory."""
    noise: NoiseSource


class Remembering(Protocol):
    """A device whose state can be read and set: `plant_sim.device.SimulatedDevice`."""

    def memory(self) -> DeviceMemory:
        """Return the whole state."""
        ...

    def resume(self, memory: DeviceMemory) -> None:
        """Go on from there."""
        ...


class CompiledDevice:
    """A device and its plant in blocks of compiled exchanges."""

    def __init__(self, device: Remembering, plant: CompiledPlant) -> None:
        self._device, self._plant = device, plant
        self._memory: WireMemory = wire_memory(VO2)._replace(line=np.zeros(SIZE, dtype=np.int64))
        self._floats = self._memory.line.view(np.float64)
        self._lent: tuple[NDArray[Any], ...] = ()

    def exchange(self) -> CompiledExchange:
        """Return the exchange for a driver."""
        function = _first_class(self._plant.kernel)
        return CompiledExchange(function, self._memory, self._conclude, self._lend, self._give_back)

    def _lend(self) -> None:
        line, m, noise = self._memory.line, self._device.memory(), self._plant.noise
        self._floats[LEVEL : EPOCH_S + 1] = m.level, m.low, m.high, m.epoch_s
        self._lent = arrays = self._plant.arrays()
        line[HEALTH : RELAYS + 1] = (
            m.status, NONE if m.sequence is None else m.sequence, m.counter, m.time_us,
            NONE if m.fed_us is None else m.fed_us, m.watchdog_us, m.lockstep, m.period_us,
            noise.row, noise.rows, arrays[3].shape[1],
        )  # fmt: skip
        line[ADDRESSES : ADDRESSES + len(arrays)] = [array.ctypes.data for array in arrays]

    def _give_back(self) -> None:
        line, before = self._memory.line, self._device.memory()
        self._lent = ()
        number, fed_us = int(line[NUMBER]), int(line[FED_US])
        self._plant.noise.row = int(line[ROW])
        self._device.resume(
            before._replace(
                level=float(self._floats[LEVEL]), status=int(line[HEALTH]), counter=int(line[COUNT]),
                time_us=int(line[NOW_US]), fed_us=None if fed_us == NONE else fed_us,
                sequence=None if number == NONE else number,
            )
            if int(line[COUNT]) == before.counter  # no exchange: what was last read stays
            else before._replace(
                level=float(self._floats[LEVEL]), status=int(line[HEALTH]), counter=int(line[COUNT]),
                time_us=int(line[NOW_US]), fed_us=fed_us, sequence=number,
                sensed=(float(self._memory.reading[0]),), reference=float(self._memory.reading[1]),
            )
        )  # fmt: skip

    def _conclude(self, ended: int, levels: Sequence[float]) -> Measurement:
        assert ended == OK
        *sensed, reference = self._memory.reading.tolist()
        return Measurement(tuple(sensed), reference, *self._memory.line[COUNTER : STATUS + 1].tolist())


@lru_cache
def _first_class(kernel: Callable[..., int]) -> Any:
    return first_class(kernel, *wire_memory(VO2))


assert tuple(range(COUNTER, COUNTER + 4)) == (COUNTER, TIME_US, IN_FORCE, STATUS)
