"""A driver's side of a compiled exchange: made before the device is opened, called with levels, gives a measurement."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numba
import numpy as np

from drivers.compiled.calls import AVAILABLE
from drivers.compiled.memory import ARRIVED, COUNTER, ERRNO, FD, OVERFLOW, STATUS, WireMemory
from rtctl.border.kernels import FloatArray, IntArray
from rtctl.border.records import Measurement

Kernel = Callable[[FloatArray, FloatArray, IntArray, Any, Any], int]


class CompiledExchange:
    """One line's exchange; its sequence numbers and descriptor are in `memory`."""

    def __init__(self, kernel: Kernel, memory: WireMemory) -> None:
        """Compiles `kernel`, or takes it from numba's cache: up to seconds."""
        self._run = _machine_code(kernel)
        self._memory = memory
        self._answer = memory.line[COUNTER : STATUS + 1]
        self._levels, self._reading = memory.levels, memory.reading

    def run(self, levels: Sequence[float]) -> int:
        """Command `levels`, wait for the answer; a code of `drivers.compiled.memory.Ended`."""
        mine = self._levels
        if len(levels) != len(mine):
            return OVERFLOW
        for k, level in enumerate(levels):
            mine[k] = level
        return self._run(*self._memory)

    def measurement(self) -> Measurement:
        """The last reading."""
        *sensed, reference = self._reading.tolist()
        return Measurement(tuple(sensed), reference, *self._answer.tolist())


def compiled_exchange(kernel: Kernel, memory: WireMemory) -> CompiledExchange | None:
    """None where this machine's calls are not those that the kernels know; Python then does the same."""
    return CompiledExchange(kernel, memory) if AVAILABLE else None


def attach(memory: WireMemory, descriptor: int) -> None:
    """The line is at this descriptor from now on; -1: nowhere."""
    memory.line[FD] = descriptor
    memory.line[ARRIVED] = 0


def system_error(memory: WireMemory) -> OSError:
    """What ended an exchange with `SYSTEM`."""
    number = int(memory.line[ERRNO])
    return OSError(number, os.strerror(number)) if number else OSError("the other end hung up")


@lru_cache
def _machine_code(kernel: Any) -> Kernel:
    """Without numba's look-up of the types at each call: they are always those of `WireMemory`."""
    float64, int64, uint8 = (numba.types.Array(t, 1, "C") for t in (numba.float64, numba.int64, numba.uint8))
    signature = (float64, float64, int64, uint8, uint8)
    kernel.compile(signature)
    code: Kernel = kernel.get_overload(signature)
    return code


assert np.dtype(np.intp).itemsize == 8 or not AVAILABLE
