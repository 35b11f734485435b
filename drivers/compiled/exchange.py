"""A driver's side of a compiled exchange: made before the device is opened, called with levels, gives a measurement."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import first_class, machine_code
from rtctl.border.records import VO2, Measurement
from rtctl.border.wire.compiled_clock import AVAILABLE
from rtctl.border.wire.wire_memory import (
    ARRIVED,
    COUNTER,
    ERRNO,
    FD,
    OVERFLOW,
    STATUS,
    CompiledExchange,
    WireMemory,
    wire_memory,
)

Kernel = Callable[[FloatArray, FloatArray, IntArray, Any, Any], int]


class LineExchange:
    """The compiled exchange of one line; its sequence numbers and descriptor are in `memory`."""

    def __init__(self, kernel: Kernel, memory: WireMemory) -> None:
        """Compile `kernel`, or load it: up to seconds."""
        self._kernel = kernel
        self._run: Kernel = machine_code(kernel, *memory)
        self._memory = memory
        self._answer = memory.line[COUNTER : STATUS + 1]
        self._levels, self._reading = memory.levels, memory.reading

    def run(self, levels: Sequence[float]) -> int:
        """Command `levels`, wait for the answer; a code of `rtctl.border.wire.wire_memory.Ended`."""
        mine = self._levels
        if len(levels) != len(mine):
            return OVERFLOW
        for k, level in enumerate(levels):
            mine[k] = level
        return self._run(*self._memory)

    def measurement(self) -> Measurement:
        """Return the last reading."""
        *sensed, reference = self._reading.tolist()
        return Measurement(tuple(sensed), reference, *self._answer.tolist())

    def compiled_exchange(self, conclude: Callable[[int, Sequence[float]], Measurement]) -> CompiledExchange:
        """Return the exchange for a compiled loop."""
        return CompiledExchange(_first_class(self._kernel), self._memory, conclude)


def line_exchange(kernel: Kernel, memory: WireMemory) -> LineExchange | None:
    """Return the compiled exchange; None if the kernels do not know this machine's system calls."""
    return LineExchange(kernel, memory) if AVAILABLE else None


def attach(memory: WireMemory, descriptor: int) -> None:
    """Move the line to this descriptor; -1: nowhere."""
    memory.line[FD] = descriptor
    memory.line[ARRIVED] = 0


def system_error(memory: WireMemory) -> OSError:
    """Return the error that ended an exchange with `SYSTEM`."""
    number = int(memory.line[ERRNO])
    return OSError(number, os.strerror(number)) if number else OSError("the other end hung up")


@lru_cache
def _first_class(kernel: Kernel) -> Any:
    return first_class(kernel, *wire_memory(VO2))


assert np.dtype(np.intp).itemsize == 8 or not AVAILABLE
