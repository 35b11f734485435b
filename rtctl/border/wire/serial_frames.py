"""Frames of the plain serial protocol: bytes to messages and back, no port and no clock (docs/serial-protocol.md).

    frame   = 00  COBS( type u8 | tag u16 | payload | CRC-16 u16 )  00        little-endian throughout
    CRC-16  = CCITT: polynomial 0x1021, start 0xFFFF, of type, tag and payload

COBS (Cheshire and Baker, IEEE/ACM Trans. Networking 7, 159, 1999) leaves no zero inside a frame, so that a receiver
that has lost its place is back at the next zero, whatever came before. Every reply carries the tag of its request:
a late one is known by it.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from rtctl.border.records import DeviceProfile, Measurement

VERSION = 1
MAX_BODY = 248
"""Bytes of type, tag and payload: in so short a frame COBS costs one byte whatever it holds."""

_HEAD = struct.Struct("<BH")
_CRC = struct.Struct("<H")
_SETTINGS = struct.Struct("<BBHI")
_IDENTITY = struct.Struct("<BBB16s")
_READING = "<HHIIf"
_CODE = [bytes((length + 1,)) for length in range(255)]
_ENDLESS = b"\xff"
"""A code of COBS that needs more bytes than a frame has: whatever follows, it is damaged."""
_LONGEST = MAX_BODY + _CRC.size + 1


class Request(IntEnum):
    """Types of messages from the host; the reply has the same with bit 7 set, or `ERROR`."""

    COMMAND = 0x01
    READ = 0x02
    SETTINGS = 0x03
    IDENTIFY = 0x04


REPLY = 0x80
ERROR = 0xFF


class ErrorCode(IntEnum):
    """Code in an `ERROR` reply."""

    UNKNOWN_TYPE = 1
    WRONG_LENGTH = 2
    ILLEGAL_VALUE = 3


class Message(NamedTuple):
    """Content of one frame."""

    type: int
    tag: int
    payload: bytes


class Settings(NamedTuple):
    """Payload of SETTINGS, and of its reply: the settings in force."""

    enable: int
    lockstep: int
    watchdog_ms: int
    period_us: int


class Identity(NamedTuple):
    """Payload of the reply to IDENTIFY."""

    version: int
    commands: int
    sensed: int
    name: str


def frame(kind: int, tag: int, payload: bytes = b"") -> bytes:
    """Return the bytes of one message, delimiters included. Raises ValueError on a payload that is too long."""
    body = _HEAD.pack(kind, tag) + payload
    if len(body) > MAX_BODY:
        raise ValueError(f"a message has at most {MAX_BODY} bytes, got {len(body)}")
    body += _CRC.pack(crc_hqx(body, 0xFFFF))
    return b"\0" + b"".join([_CODE[len(run)] + run for run in body.split(b"\0")]) + b"\0"


def unframe(stuffed: bytes) -> Message | None:
    """Return the message between two delimiters; None where it is damaged."""
    body = _unstuffed(stuffed)
    if (
        body is None
        or len(body) < _HEAD.size + _CRC.size
        or crc_hqx(body[:-2], 0xFFFF) != body[-2] | body[-1] << 8
    ):
        return None
    return Message(body[0], body[1] | body[2] << 8, body[3:-2])


def _unstuffed(stuffed: bytes) -> bytes | None:
    runs, at, end = [], 0, len(stuffed)
    while at < end:
        after = at + stuffed[at]
        if after == at or after > end:
            return None
        runs.append(stuffed[at + 1 : after])
        at = after
    return b"\0".join(runs)


class FrameReader:
    """Decoder of bytes as they arrive to whole, valid messages; `damaged` counts discarded frames."""

    def __init__(self) -> None:
        self.damaged = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that `data` completes."""
        whole = (self._rest + data).split(b"\0")
        self._rest = whole.pop()
        if len(self._rest) > _LONGEST:  # no frame is so long: a babbling line must not fill the memory
            self._rest = _ENDLESS  # not its first byte: that and what follows may be a frame which never was
            self.damaged += 1
        messages = []
        for stuffed in whole:
            if stuffed:
                message = unframe(stuffed) if len(stuffed) <= _LONGEST else None
                if message is None:
                    self.damaged += 1
                else:
                    messages.append(message)
        return messages


def settings_payload(settings: Settings) -> bytes:
    """Return the payload of 8 bytes."""
    return _SETTINGS.pack(*settings)


def settings_of(payload: bytes) -> Settings | None:
    """Decode the settings; None where the length is wrong."""
    return Settings(*_SETTINGS.unpack(payload)) if len(payload) == _SETTINGS.size else None


def identity_payload(profile: DeviceProfile, name: str) -> bytes:
    """Return 19 bytes: version, numbers of commands and readings, ASCII name."""
    raw = name.encode("ascii", "replace")[:16]
    return _IDENTITY.pack(VERSION, len(profile.commands), len(profile.sensed), raw)


def identity_of(payload: bytes) -> Identity | None:
    """Decode the identity; None where the length is wrong."""
    if len(payload) != _IDENTITY.size:
        return None
    version, commands, sensed, raw = _IDENTITY.unpack(payload)
    return Identity(version, commands, sensed, raw.rstrip(b"\0 ").decode("ascii", "replace"))


class Layout:
    """Payloads whose length depends on the kind of device."""

    def __init__(self, profile: DeviceProfile) -> None:
        self._levels = struct.Struct(f"<{len(profile.commands)}f")
        self._reading = struct.Struct(_READING + len(profile.sensed) * "f")

    def command(self, levels: Sequence[float]) -> bytes:
        """Return the payload of COMMAND.

        Raises:
            OverflowError: A level is beyond float32.
            struct.error: The number of levels is wrong.
        """
        return self._levels.pack(*levels)

    def levels(self, payload: bytes) -> tuple[float, ...] | None:
        """Decode the levels; None where the length is wrong."""
        return self._levels.unpack(payload) if len(payload) == self._levels.size else None

    def reading(self, m: Measurement) -> bytes:
        """Return the payload of the replies to COMMAND and READ."""
        return self._reading.pack(m.sequence, m.status, m.counter, m.time_us, m.reference, *m.sensed)

    def measurement(self, payload: bytes) -> Measurement | None:
        """Decode a measurement; None where the length is wrong."""
        if len(payload) != self._reading.size:
            return None
        values = self._reading.unpack(payload)
        sequence, status, counter, time_us, reference = values[:5]
        return Measurement(values[5:], reference, counter, time_us, sequence, status)
