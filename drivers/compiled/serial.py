"""One exchange of the plain serial protocol as compiled code.

The bytes are those of `rtctl.border.wire.serial_frames`, its oracle. A message with another tag, or a damaged one, is
dropped, and reading goes on. An answer that is no reading is left in `inbox` at `REPLY_AT`, without its checksum.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivers.compiled.calls import now_ns, received, sent
from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import background_kernel
from rtctl.border.records import DeviceStatus
from rtctl.border.wire.serial_frames import ERROR, MAX_BODY, Request
from rtctl.border.wire.serial_frames import REPLY as ANSWERS
from rtctl.border.wire.wire_memory import (
    ARRIVED,
    COUNTER,
    DAMAGED,
    FULL,
    IN_FORCE,
    INBOX_BYTES,
    OK,
    OVERFLOW,
    REPLY,
    REPLY_AT,
    REPLY_LENGTH,
    SEQUENCE,
    SILENT,
    STALE,
    STATUS,
    SYSTEM,
    TIME_US,
    TIMEOUT_NS,
    ByteArray,
)

wide: Any = np.int64
_REFUSED = int(DeviceStatus.REFUSED)
_COMMAND = int(Request.COMMAND)
_ANSWER = _COMMAND | ANSWERS
_HEAD, _CRC = 3, 2
_LONGEST = MAX_BODY + _CRC + 1
_FIXED = 16
"""Bytes of a reading before the sensed values: number, status, counter, time, reference."""


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
        table.append(crc)
    return table


_TABLE = np.array(_crc_table(), dtype=np.int64)


@background_kernel
def crc_ccitt(data: ByteArray, begin: int, end: int) -> int:
    """Return the CRC of polynomial 0x1021 and start 0xFFFF."""
    crc = 0xFFFF
    for at in range(begin, end):
        crc = (crc << 8 & 0xFFFF) ^ _TABLE[(crc >> 8 ^ wide(data[at])) & 0xFF]
    return crc


@background_kernel
def put_little(data: ByteArray, at: int, value: int, count: int) -> int:
    """Put `count` bytes, little-endian, at `at`; return the place behind them."""
    for k in range(count):
        data[at + k] = value >> 8 * k & 0xFF
    return at + count


@background_kernel
def little_at(data: ByteArray, at: int, count: int) -> int:
    """Return the little-endian number at `at`."""
    value = 0
    for k in range(count):
        value |= wide(data[at + k]) << 8 * k
    return value


@background_kernel
def little_float_at(data: ByteArray, at: int) -> float:
    """Return the float32 at `at`."""
    return float(np.uint32(little_at(data, at, 4)).view(np.float32))


@background_kernel
def stuffed(out: ByteArray, begin: int, end: int) -> int:
    """Frame the body in `out[begin:end]` (at most 254 bytes, `begin` >= 2) from 0 on; return the frame's length."""
    out[0] = 0
    code_at, at = 1, 2
    for k in range(begin, end):
        byte = out[k]
        if byte == 0:
            out[code_at] = at - code_at
            code_at = at
        else:
            out[at] = byte
        at += 1
    out[code_at] = at - code_at
    out[at] = 0
    return at + 1


@background_kernel
def unstuffed(data: ByteArray, begin: int, end: int) -> int:
    """Undo COBS in place, from `begin` on; the body's length, -1 where it is damaged."""
    read, write = begin, begin
    while read < end:
        code = wide(data[read])
        after = read + code
        if after > end:  # a code of 0 is none: it would have been a delimiter
            return -1
        for k in range(read + 1, after):
            data[write] = data[k]
            write += 1
        read = after
        if read < end:
            data[write] = 0
            write += 1
    return write - begin


@background_kernel
def command_into(out: ByteArray, line: IntArray, levels: FloatArray) -> int:
    """Frame a command; return its length, or -1: a level is beyond float32, and no tag is used up."""
    for k in range(levels.size):
        if math.isfinite(levels[k]) and not math.isfinite(np.float32(levels[k])):
            return -1
    line[SEQUENCE] = (line[SEQUENCE] + 1) & 0xFFFF  # never sent twice, whatever comes of it
    out[2] = _COMMAND
    at = put_little(out, 3, line[SEQUENCE], 2)
    for k in range(levels.size):
        at = put_little(out, at, wide(np.float32(levels[k]).view(np.uint32)), 4)
    at = put_little(out, at, crc_ccitt(out, 2, at), _CRC)
    return stuffed(out, 2, at)


@background_kernel
def read_message(reading: FloatArray, line: IntArray, inbox: ByteArray, begin: int, length: int) -> int:
    """Return how the exchange ended if this body answers it; -1: it does not."""
    if length < _HEAD + _CRC or crc_ccitt(inbox, begin, begin + length - _CRC) != little_at(
        inbox, begin + length - _CRC, _CRC
    ):
        line[DAMAGED] += 1
        return -1
    kind = inbox[begin]
    if little_at(inbox, begin + 1, 2) != line[SEQUENCE] or kind not in (_ANSWER, ERROR):
        return -1
    line[REPLY_AT], line[REPLY_LENGTH] = begin, length - _CRC
    if kind == ERROR or length - _HEAD - _CRC != _FIXED + 4 * (reading.size - 1):
        return REPLY
    at = begin + _HEAD
    line[IN_FORCE], line[STATUS] = little_at(inbox, at, 2), little_at(inbox, at + 2, 2)
    line[COUNTER], line[TIME_US] = little_at(inbox, at + 4, 4), little_at(inbox, at + 8, 4)
    reading[reading.size - 1] = little_float_at(inbox, at + 12)
    for k in range(reading.size - 1):
        reading[k] = little_float_at(inbox, at + _FIXED + 4 * k)
    return OK if line[IN_FORCE] == line[SEQUENCE] or line[STATUS] & _REFUSED else STALE


@background_kernel
def exchange_serial(
    levels: FloatArray, reading: FloatArray, line: IntArray, out: ByteArray, inbox: ByteArray
) -> int:
    """Take one exchange on a non-blocking serial port; return a code of `Ended`."""
    line[DAMAGED] = 0
    length = command_into(out, line, levels)
    if length < 0:
        return OVERFLOW
    went = sent(line, out, length, False)
    if went <= 0:
        return SYSTEM if went < 0 else FULL
    deadline_ns = now_ns(line) + line[TIMEOUT_NS]
    begin, end = 0, line[ARRIVED]  # the first part of an incomplete frame
    while True:
        line[ARRIVED] = end
        got = received(line, inbox, end, deadline_ns)
        if got <= 0:
            return SYSTEM if got < 0 else SILENT
        begin, ended = 0, -1
        for at in range(end, end + got):
            if inbox[at] != 0:
                continue
            if at > begin and ended < 0:
                body = unstuffed(inbox, begin, at)
                ended = read_message(reading, line, inbox, begin, body)
            begin = at + 1
        end += got
        if ended == REPLY:  # the driver explains it from where it lies
            line[ARRIVED] = 0
            return ended
        for k in range(end - begin):
            inbox[k] = inbox[begin + k]
        end -= begin
        if end > _LONGEST or INBOX_BYTES - end < _LONGEST:  # no frame is so long: a babbling line
            inbox[0] = 0xFF  # a code that needs more bytes than a frame has, so that the rest is damaged
            end = 1
            line[DAMAGED] += 1
        line[ARRIVED] = end
        if ended >= 0:
            return ended
