"""The register map of the device on the wire: addresses, 32-bit words (high word first), float32.

Modbus holding registers of unit 1. The map is fixed: foreign devices and clients are written against it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from rtctl.border.records import DeviceProfile

COMMAND = 0  # float32; the first channel
SEQUENCE = 2
ENABLE = 3
WATCHDOG_MS = 4
CLOCK = 5  # 0 free-running, 1 lockstep
PERIOD_US = 6  # uint32
FURTHER_COMMANDS = 8  # float32 each, two registers a channel: those beyond the first
READING = 100
COUNTER = 102
STATUS = 104
TIME_US = 105
REFERENCE = 107
SEQUENCE_IN_FORCE = 109
READING_COUNT = 10  # 100-109 in one read; more where a channel lies beyond them
IDENTITY = 120
IDENTITY_COUNT = 8
MAP_END = 128


def float32_words(value: float) -> tuple[int, int]:
    """Return the two registers of a float32, high word first. Raises OverflowError beyond float32's range."""
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return high, low


def words_float32(high: int, low: int) -> float:
    """Return the float32 in two registers."""
    value: float = struct.unpack(">f", struct.pack(">HH", high, low))[0]
    return value


def uint32_words(value: int) -> tuple[int, int]:
    """Return the two registers of an integer modulo 2^32, high word first."""
    return (value >> 16) & 0xFFFF, value & 0xFFFF


def words_uint32(high: int, low: int) -> int:
    """Return the uint32 in two registers."""
    return (high << 16) | low


def identity_words(identity: str) -> list[int]:
    """Return eight registers: ASCII, 16 bytes, zero-padded."""
    raw = identity.encode("ascii", "replace")[:16].ljust(16, b"\0")
    return list(struct.unpack(">8H", raw))


def words_identity(words: Sequence[int]) -> str:
    """Return the ASCII identity in eight registers, without padding."""
    return struct.pack(">8H", *words).rstrip(b"\0 ").decode("ascii", "replace")


def check_layout(profile: DeviceProfile) -> None:
    """Raise ValueError unless the commands lie at 0, then from 8 on without a gap."""
    found = [channel.register for channel in profile.commands]
    wanted = [COMMAND, *range(FURTHER_COMMANDS, FURTHER_COMMANDS + 2 * (len(found) - 1), 2)]
    if found != wanted:
        raise ValueError(f"profile {profile.kind}: commands lie at {found}, the register map has {wanted}")


def reading_count(profile: DeviceProfile) -> int:
    """Return the number of registers from 100 on that one read of this kind of device takes."""
    channels = (*profile.sensed, profile.reference)
    return max(READING_COUNT, *(channel.register + 2 - READING for channel in channels))
