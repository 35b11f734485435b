"""Memory of a compiled exchange: one array of numbers a line, and the codes of how it ended.

The numbers are int64; the slots from `POLL` on are laid out as the system calls want them (`struct pollfd`, `struct
timespec`), little-endian.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.records import DeviceProfile, Measurement

FD, TIMEOUT_NS, UNIT, TRANSACTION, SEQUENCE, REGISTERS, ARRIVED, ERRNO, REPLY_AT, REPLY_LENGTH, DAMAGED = (
    range(11)
)
"""Descriptor; timeout [ns]; Modbus unit; last transaction; last sequence number or tag; registers of a reading; bytes
of an unfinished frame; errno of a failed call (0: the other end hung up); where a reply lies that is no reading;
damaged frames of this exchange."""
SETTINGS = 11
"""Slots of five Modbus registers that a command of several channels runs over."""
COUNTER, TIME_US, IN_FORCE, STATUS = 16, 17, 18, 19
"""Slots of a reading: sample counter, device time [us], sequence in force, status bits."""
SENSED_AT = 20
"""Offset of each reading in the registers [bytes]; the reference is the last."""
MOST_READINGS = 8
POLL = 30
CLOCK = 32
LINE_SIZE = 40

INBOX_BYTES = 4096
OUT_BYTES = 320

ByteArray = NDArray[np.uint8]


class Ended(IntEnum):
    """How an exchange ended; the driver explains all but `OK`."""

    OK = 0
    SILENT = 1
    SYSTEM = 2
    FULL = 3
    REPLY = 4
    STALE = 5
    OVERFLOW = 6
    PYTHON = 7
    """Nothing has happened; the driver's own exchange has to do it."""


OK, SILENT, SYSTEM, FULL, REPLY, STALE, OVERFLOW, PYTHON = (
    int(code) for code in Ended
)  # a kernel knows plain integers


class WireMemory(NamedTuple):
    """Arguments of a compiled exchange, in its order."""

    levels: FloatArray
    """Levels (commands,) to send, in the profile's units."""
    reading: FloatArray
    """Received (sensed + 1,): the sensed values, then the reference."""
    line: IntArray
    out: ByteArray
    inbox: ByteArray


def nothing() -> None:
    """Do nothing: the memory already has all that outlives an exchange."""


class CompiledExchange(NamedTuple):
    """An exchange that a compiled loop calls itself, returned by a driver's `compiled_exchange` if it has one."""

    function: Any
    """First-class function of numba: `WireMemory`'s arrays to a code of `Ended`."""
    memory: WireMemory
    conclude: Callable[[int, Sequence[float]], Measurement]
    """Converts a code after a command of these levels to a measurement, or raises DriverError."""
    lend: Callable[[], None] = nothing
    """Copies what outlives an exchange to the memory, before a block of exchanges."""
    give_back: Callable[[], None] = nothing
    """Copies it back after the block."""


def wire_memory(profile: DeviceProfile) -> WireMemory:
    """Return the memory of a closed line to a device of this kind."""
    readings = len(profile.sensed) + 1
    if readings > MOST_READINGS:
        raise ValueError(
            f"profile {profile.kind}: at most {MOST_READINGS - 1} sensed channels, got {readings - 1}"
        )
    line = np.zeros(LINE_SIZE, dtype=np.int64)
    line[FD] = -1
    return WireMemory(
        np.zeros(len(profile.commands)),
        np.zeros(readings),
        line,
        np.zeros(OUT_BYTES, dtype=np.uint8),
        np.zeros(INBOX_BYTES, dtype=np.uint8),
    )
