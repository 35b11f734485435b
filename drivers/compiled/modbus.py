"""One transaction of function 23 as compiled code: the bytes are those of `drivers.modbus_frames`, which is its oracle.

`exchange_tcp` and `exchange_rtu` send the levels under the next sequence number and read registers 100 on. What is
sound but no reading (an exception, another function's reply) is left in `inbox` at `REPLY_AT`; the driver explains it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivers.compiled.calls import drained, now_ns, received, received_blocking, sent
from drivers.modbus_frames import CRC_TABLE
from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import background_kernel
from rtctl.border.records import DeviceStatus
from rtctl.border.wire.registers import COMMAND, READING, SEQUENCE_IN_FORCE
from rtctl.border.wire.registers import COUNTER as COUNTER_REGISTER
from rtctl.border.wire.wire_memory import (
    ARRIVED,
    COUNTER,
    FULL,
    IN_FORCE,
    INBOX_BYTES,
    OK,
    OVERFLOW,
    REGISTERS,
    REPLY,
    REPLY_AT,
    REPLY_LENGTH,
    SENSED_AT,
    SEQUENCE,
    SETTINGS,
    SILENT,
    STALE,
    STATUS,
    SYSTEM,
    TIME_US,
    TIMEOUT_NS,
    TRANSACTION,
    UNIT,
    ByteArray,
)

_TABLE = np.array(CRC_TABLE, dtype=np.int64)
wide: Any = np.int64
_REFUSED = int(DeviceStatus.REFUSED)
_COUNTER_AT, _IN_FORCE_AT = 2 * (COUNTER_REGISTER - READING), 2 * (SEQUENCE_IN_FORCE - READING)
_FUNCTION = 23
_MBAP = 7
_LONGEST = 260
_SHORTEST_RTU = 5


@background_kernel
def crc16(data: ByteArray, begin: int, end: int) -> int:
    """Return the checksum of `data[begin:end]`, as `drivers.modbus_frames.crc16` does."""
    crc = 0xFFFF
    for at in range(begin, end):
        crc = crc >> 8 ^ _TABLE[(crc ^ wide(data[at])) & 0xFF]
    return crc


@background_kernel
def put_word(data: ByteArray, at: int, word: int) -> int:
    """Put a big-endian word at `at`; return the place behind it."""
    data[at] = word >> 8 & 0xFF
    data[at + 1] = word & 0xFF
    return at + 2


@background_kernel
def word_at(data: ByteArray, at: int) -> int:
    """Return the big-endian word at `at`."""
    word: int = wide(data[at]) << 8 | wide(data[at + 1])
    return word


@background_kernel
def float_at(data: ByteArray, at: int) -> float:
    """Return the float32 at `at`, whose high word comes first."""
    bits = np.uint32(word_at(data, at) << 16 | word_at(data, at + 2))
    return float(bits.view(np.float32))


@background_kernel
def request_into(out: ByteArray, at: int, line: IntArray, levels: FloatArray) -> int:
    """Put a request of function 23 at `at`; return the place behind it, or -1: a level is beyond float32."""
    words = 3 if levels.size == 1 else 8 + 2 * (levels.size - 1)
    out[at] = _FUNCTION
    at = put_word(out, at + 1, READING)
    at = put_word(out, at, line[REGISTERS])
    at = put_word(out, at, COMMAND)
    at = put_word(out, at, words)
    out[at] = 2 * words
    at += 1
    for k in range(levels.size):
        narrow = np.float32(levels[k])
        if math.isfinite(levels[k]) and not math.isfinite(narrow):
            return -1
        bits = wide(narrow.view(np.uint32))
        at = put_word(out, put_word(out, at, bits >> 16), bits & 0xFFFF)
        if k == 0:
            at = put_word(out, at, line[SEQUENCE])
            if levels.size > 1:
                for slot in range(SETTINGS, SETTINGS + 5):
                    at = put_word(out, at, line[slot])
    return at


@background_kernel
def read_registers(reading: FloatArray, line: IntArray, inbox: ByteArray, at: int, length: int) -> int:
    """Read the registers of a reply (function code and body, from `at` on); return how the exchange ended."""
    line[REPLY_AT], line[REPLY_LENGTH] = at, length
    count = 2 * line[REGISTERS]
    if inbox[at] != _FUNCTION or length != 2 + count or inbox[at + 1] != count:
        return REPLY
    at += 2
    for k in range(reading.size):
        reading[k] = float_at(inbox, at + line[SENSED_AT + k])
    begin = at + _COUNTER_AT
    line[COUNTER] = word_at(inbox, begin) << 16 | word_at(inbox, begin + 2)
    line[STATUS] = word_at(inbox, begin + 4)
    line[TIME_US] = word_at(inbox, begin + 6) << 16 | word_at(inbox, begin + 8)
    line[IN_FORCE] = word_at(inbox, at + _IN_FORCE_AT)
    return OK if line[IN_FORCE] == line[SEQUENCE] or line[STATUS] & _REFUSED else STALE


@background_kernel
def exchange_tcp(
    levels: FloatArray, reading: FloatArray, line: IntArray, out: ByteArray, inbox: ByteArray
) -> int:
    """Take one transaction on a connected socket, no longer than the timeout; return a code of `Ended`."""
    line[SEQUENCE] = (line[SEQUENCE] + 1) & 0xFFFF  # never sent twice, whatever comes of it
    deadline_ns = now_ns(line) + line[TIMEOUT_NS]
    end = request_into(out, _MBAP, line, levels)
    if end < 0:
        return OVERFLOW
    line[TRANSACTION] = (line[TRANSACTION] + 1) & 0xFFFF
    put_word(out, 0, line[TRANSACTION])
    put_word(out, 2, 0)
    put_word(out, 4, end - 6)
    out[6] = line[UNIT]
    went = sent(line, out, end, True)
    if went <= 0:
        return SYSTEM if went < 0 else FULL
    begin, end = 0, 0
    while now_ns(line) < deadline_ns:
        if INBOX_BYTES - end < _LONGEST:  # what is left of older replies, to the front
            for k in range(end - begin):
                inbox[k] = inbox[begin + k]
            begin, end = 0, end - begin
        got = received_blocking(line, inbox, end, deadline_ns)
        if got <= 0:
            return SYSTEM if got < 0 else SILENT
        end += got
        while end - begin >= _MBAP:
            length = word_at(inbox, begin + 4)
            if word_at(inbox, begin + 2) != 0 or not 3 <= length <= 254:
                return SILENT  # no Modbus
            after = begin + 6 + length
            if after > end:
                break
            if word_at(inbox, begin) == line[TRANSACTION] and inbox[begin + 6] == line[UNIT]:
                return read_registers(reading, line, inbox, begin + _MBAP, length - 1)
            begin = after  # another transaction's
    return SILENT


@background_kernel
def rtu_reply(line: IntArray, inbox: ByteArray, end: int) -> int:
    """Return where the unit's first valid reply begins in `inbox[:end]`, or -1; its length goes to `REPLY_LENGTH`."""
    for at in range(end - _SHORTEST_RTU + 1):
        if inbox[at] != line[UNIT]:
            continue
        function = inbox[at + 1]
        if function & 0x80:
            length = _SHORTEST_RTU
        elif function == 3 or function == _FUNCTION:
            length = _SHORTEST_RTU + wide(inbox[at + 2])
        else:
            length = 8
        after = at + length
        if after <= end and crc16(inbox, at, after - 2) == inbox[after - 2] | wide(inbox[after - 1]) << 8:
            line[REPLY_LENGTH] = length
            return at
    return -1


@background_kernel
def exchange_rtu(
    levels: FloatArray, reading: FloatArray, line: IntArray, out: ByteArray, inbox: ByteArray
) -> int:
    """Take one transaction on a non-blocking serial port; return a code of `Ended`."""
    line[SEQUENCE] = (line[SEQUENCE] + 1) & 0xFFFF
    end = request_into(out, 1, line, levels)
    if end < 0:
        return OVERFLOW
    deadline_ns = now_ns(line) + line[TIMEOUT_NS]
    out[0] = line[UNIT]
    checksum = crc16(out, 0, end)
    out[end], out[end + 1] = checksum & 0xFF, checksum >> 8
    if not drained(line, inbox, deadline_ns):
        return SYSTEM
    went = sent(line, out, end + 2, False)
    if went <= 0:
        return SYSTEM if went < 0 else FULL
    line[ARRIVED] = 0
    while True:
        if INBOX_BYTES - line[ARRIVED] < _LONGEST:  # noise: a reply can only be at its end
            for k in range(_LONGEST):
                inbox[k] = inbox[line[ARRIVED] - _LONGEST + k]
            line[ARRIVED] = _LONGEST
        got = received(line, inbox, line[ARRIVED], deadline_ns)
        if got <= 0:
            return SYSTEM if got < 0 else SILENT
        line[ARRIVED] += got
        at = rtu_reply(line, inbox, line[ARRIVED])
        if at >= 0:
            return read_registers(reading, line, inbox, at + 1, line[REPLY_LENGTH] - 3)
