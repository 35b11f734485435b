"""Modbus frames of the side that asks: bytes to bytes, no port and no clock (application protocol V1.1b3)."""

from __future__ import annotations

import struct
from typing import NamedTuple

READ, WRITE, WRITE_THEN_READ = 3, 16, 23
EXCEPTION = 0x80
_MBAP = struct.Struct(">HHHB")
_CRC = struct.Struct("<H")
_WITH_COUNT = (READ, WRITE_THEN_READ)
_WRITE_REPLY = 8
_EXCEPTION_REPLY = 5
_MAX_TCP_LENGTH = 254


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
        table.append(crc)
    return tuple(table)


CRC_TABLE = _crc_table()
"""Table of the low byte's checksums; the compiled exchange has it too."""


def crc16(data: bytes) -> int:
    """Return the serial line's checksum: polynomial 0xA001 (reflected 0x8005), start 0xFFFF."""
    crc, table = 0xFFFF, CRC_TABLE
    for byte in data:
        crc = crc >> 8 ^ table[(crc ^ byte) & 0xFF]
    return crc


def read_request(address: int, count: int) -> bytes:
    """Return a request of function 3."""
    return struct.pack(">BHH", READ, address, count)


def write_request(address: int, words: list[int]) -> bytes:
    """Return a request of function 16."""
    count = len(words)
    return struct.pack(f">BHHB{count}H", WRITE, address, count, 2 * count, *words)


def write_then_read_request(address: int, words: list[int], read_address: int, read_count: int) -> bytes:
    """Return a request of function 23."""
    count = len(words)
    return struct.pack(
        f">BHHHHB{count}H", WRITE_THEN_READ, read_address, read_count, address, count, 2 * count, *words
    )


def to_rtu(unit: int, pdu: bytes) -> bytes:
    """Return a frame of RTU: unit, request or reply, checksum."""
    body = bytes((unit,)) + pdu
    return body + _CRC.pack(crc16(body))


def from_rtu(unit: int, data: bytes) -> bytes | None:
    """Return the first valid reply of `unit` in `data`, whatever stands before it; None: there is none yet."""
    for at in range(len(data) - _EXCEPTION_REPLY + 1):
        if data[at] != unit:
            continue
        function = data[at + 1]
        if function & EXCEPTION:
            length = _EXCEPTION_REPLY
        elif function in _WITH_COUNT:
            length = _EXCEPTION_REPLY + data[at + 2]
        else:
            length = _WRITE_REPLY
        frame = data[at : at + length]
        if len(frame) == length and crc16(frame[:-2]) == frame[-2] | frame[-1] << 8:
            return frame[1:-2]
    return None


class TcpReply(NamedTuple):
    """A frame of a TCP connection."""

    transaction: int
    unit: int
    pdu: bytes
    used: int
    """Size of the frame [bytes]."""


def to_tcp(transaction: int, unit: int, pdu: bytes) -> bytes:
    """Return a frame of TCP: header and request."""
    return _MBAP.pack(transaction, 0, len(pdu) + 1, unit) + pdu


def from_tcp(data: bytes) -> TcpReply | None:
    """Return the first reply in `data`; None: it is not whole yet. Raises ValueError if it is no Modbus."""
    if len(data) < _MBAP.size:
        return None
    transaction, protocol, length, unit = _MBAP.unpack_from(data)
    if protocol != 0 or not 3 <= length <= _MAX_TCP_LENGTH:
        raise ValueError(f"protocol {protocol}, length {length}")
    end = length + 6
    return TcpReply(transaction, unit, data[_MBAP.size : end], end) if len(data) >= end else None
