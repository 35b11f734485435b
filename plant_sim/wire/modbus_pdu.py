"""Modbus requests to replies, bytes to bytes: functions 3, 6, 16 and 23 of the application protocol V1.1b3.

pymodbus's server splits function 23 into a write and a read, each checked by itself, so that a bad read
range is refused after the command has already moved the device; it answers for units that are not there;
and it opens a serial port by its path, which the master of a pty does not have. Requests are therefore
answered here, in one step, and only the frames' checks come from pymodbus.
"""

from __future__ import annotations

import struct

from plant_sim.wire.register_file import ILLEGAL_FUNCTION, ILLEGAL_VALUE, Refusal, RegisterFile

MAX_READ, MAX_WRITE, MAX_WRITE_IN_23 = 125, 123, 121
"""Most registers in one request (section 6 of the specification)."""


def answer(registers: RegisterFile, request: bytes) -> bytes:
    """Return the reply to `request` (function code and body, without unit and checksum); never raises Refusal."""
    function = request[0]
    try:
        verb = _VERBS.get(function)
        if verb is None:
            raise Refusal(ILLEGAL_FUNCTION)
        return request[:1] + verb(registers, request[1:])
    except Refusal as refusal:
        return bytes((function | 0x80, refusal.code))


def _read(registers: RegisterFile, body: bytes) -> bytes:
    _check_counts(len(body) == 4)
    address, count = struct.unpack(">HH", body)
    _check_counts(1 <= count <= MAX_READ)
    return bytes((2 * count,)) + registers.read(address, count)


def _write_one(registers: RegisterFile, body: bytes) -> bytes:
    _check_counts(len(body) == 4)
    registers.write(int.from_bytes(body[:2], "big"), body[2:])
    return body


def _write(registers: RegisterFile, body: bytes) -> bytes:
    _check_counts(len(body) >= 5)
    address, count, size = struct.unpack(">HHB", body[:5])
    _check_counts(1 <= count <= MAX_WRITE and size == 2 * count == len(body) - 5)
    registers.write(address, body[5:])
    return body[:4]


def _write_then_read(registers: RegisterFile, body: bytes) -> bytes:
    _check_counts(len(body) >= 9)
    read_address, read_count, address, count, size = struct.unpack(">HHHHB", body[:9])
    _check_counts(1 <= read_count <= MAX_READ and 1 <= count <= MAX_WRITE_IN_23)
    _check_counts(size == 2 * count == len(body) - 9)
    registers.check_readable(read_address, read_count)
    registers.write(address, body[9:])
    return bytes((2 * read_count,)) + registers.read(read_address, read_count)


def _check_counts(consistent: bool) -> None:
    if not consistent:
        raise Refusal(ILLEGAL_VALUE)


_VERBS = {3: _read, 6: _write_one, 16: _write, 23: _write_then_read}
