"""The machine's monotonic clock and its sleep from compiled code that holds no interpreter's lock.

The C library's functions are found by their names when the machine code is loaded, so that it can be kept on disk.
Reference: POSIX.1-2017 clock_gettime, clock_nanosleep.
"""

from __future__ import annotations

import sys
from typing import Any

import numba

from rtctl.border.arrays import IntArray
from rtctl.border.kernels import background_kernel

_of_numba: Any = numba  # which mypy knows by half
types = _of_numba.types
AVAILABLE = sys.platform == "linux" and sys.byteorder == "little" and not _of_numba.config.DISABLE_JIT
"""Whether this machine's system calls are the ones written here."""

SECOND_NS = 1_000_000_000
_MONOTONIC, _ABSOLUTE = 1, 1


def external(name: str, answer: Any, *arguments: Any) -> Any:
    """Return a function of the C library with these types."""
    return types.ExternalFunction(name, answer(*arguments))


_clock_gettime = external("clock_gettime", types.int32, types.int32, types.uintp)
_clock_nanosleep = external(
    "clock_nanosleep", types.int32, types.int32, types.int32, types.uintp, types.uintp
)


@background_kernel
def clock_ns(scratch: IntArray, at: int) -> int:
    """Return the time [ns]; two numbers of `scratch` from `at` on are used."""
    _clock_gettime(_MONOTONIC, scratch.ctypes.data + 8 * at)
    found: int = scratch[at] * SECOND_NS + scratch[at + 1]
    return found


@background_kernel
def slept_until(scratch: IntArray, at: int, wake_ns: int) -> bool:
    """Sleep until that time [ns]; return False if a signal came first."""
    scratch[at] = wake_ns // SECOND_NS
    scratch[at + 1] = wake_ns % SECOND_NS
    woken: bool = _clock_nanosleep(_MONOTONIC, _ABSOLUTE, scratch.ctypes.data + 8 * at, 0) == 0
    return woken
