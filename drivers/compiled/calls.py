"""The system's calls from compiled code: write, wait, read, the monotonic clock; a signal interrupts none for good.

A call that a signal has cut short is made again with the time that is left (Python runs its handlers after the
exchange). Reference: POSIX.1-2017 write, ppoll, read, send, clock_gettime.
"""

from __future__ import annotations

import errno
import select
import socket

from rtctl.border.arrays import IntArray
from rtctl.border.kernels import background_kernel, carray
from rtctl.border.wire.compiled_clock import SECOND_NS, clock_ns, external, types
from rtctl.border.wire.wire_memory import CLOCK, ERRNO, FD, POLL, ByteArray

_EINTR, _EAGAIN = errno.EINTR, errno.EAGAIN
_POLLIN = int(select.POLLIN)
_NOSIGNAL = int(getattr(socket, "MSG_NOSIGNAL", 0))


_write = external("write", types.intp, types.int32, types.uintp, types.uintp)
_send = external("send", types.intp, types.int32, types.uintp, types.uintp, types.int32)
_read = external("read", types.intp, types.int32, types.uintp, types.uintp)
_ppoll = external("ppoll", types.int32, types.uintp, types.uintp, types.uintp, types.uintp)
_errno_location = external("__errno_location", types.CPointer(types.int32))


@background_kernel
def last_errno() -> int:
    """Return the error number of the last call that failed."""
    number: int = carray(_errno_location(), 1)[0]
    return number


@background_kernel
def now_ns(line: IntArray) -> int:
    """Return the time of the monotonic clock [ns]."""
    return clock_ns(line, CLOCK)


@background_kernel
def sent(line: IntArray, out: ByteArray, length: int, is_socket: bool) -> int:
    """Write `length` bytes at once or not at all: 1; 0: there is no room; -1: `ERRNO` says why not."""
    while True:
        if is_socket:
            written = _send(line[FD], out.ctypes.data, length, _NOSIGNAL)
        else:
            written = _write(line[FD], out.ctypes.data, length)
        if written == length:
            return 1
        if written >= 0:
            return 0
        line[ERRNO] = last_errno()
        if line[ERRNO] == _EAGAIN:
            return 0
        if line[ERRNO] != _EINTR:
            return -1


@background_kernel
def received(line: IntArray, inbox: ByteArray, at: int, deadline_ns: int) -> int:
    """Read bytes into `inbox` from `at` on, as soon as there are any.

    Args:
        line: the line's numbers.
        inbox: room for the bytes.
        at: where they go.
        deadline_ns: monotonic time at which to give up [ns].

    Returns:
        How many bytes were read; 0: none until the deadline; -1: the call failed, or (`ERRNO` 0) the other end hung up.
    """
    while True:
        left_ns = max(deadline_ns - now_ns(line), 0)
        line[POLL] = line[FD] | _POLLIN << 32
        line[CLOCK] = left_ns // SECOND_NS
        line[CLOCK + 1] = left_ns % SECOND_NS
        ready = _ppoll(line.ctypes.data + 8 * POLL, 1, line.ctypes.data + 8 * CLOCK, 0)
        if ready == 0:
            return 0
        if ready > 0:
            got = _read(line[FD], inbox.ctypes.data + at, inbox.size - at)
            if got > 0:
                count: int = got
                return count
            line[ERRNO] = 0 if got == 0 else last_errno()
        else:
            line[ERRNO] = last_errno()
        if line[ERRNO] not in (_EINTR, _EAGAIN):
            return -1
        if left_ns == 0:
            return 0


@background_kernel
def received_blocking(line: IntArray, inbox: ByteArray, at: int, deadline_ns: int) -> int:
    """Read as `received` does, from a blocking socket whose own timeout ends a wait: one call less."""
    while True:
        got = _read(line[FD], inbox.ctypes.data + at, inbox.size - at)
        if got > 0:
            count: int = got
            return count
        line[ERRNO] = 0 if got == 0 else last_errno()
        if line[ERRNO] == _EAGAIN or (line[ERRNO] == _EINTR and now_ns(line) >= deadline_ns):
            return 0
        if line[ERRNO] != _EINTR:
            return -1


@background_kernel
def drained(line: IntArray, inbox: ByteArray, deadline_ns: int) -> bool:
    """Read and forget what has arrived, of a descriptor that does not block. False: `ERRNO` says why not."""
    while True:
        got = _read(line[FD], inbox.ctypes.data, inbox.size)
        if got < 0:
            line[ERRNO] = last_errno()
            if line[ERRNO] == _EAGAIN:
                return True
            if line[ERRNO] != _EINTR:
                return False
        elif got == 0:
            return True
        if now_ns(line) >= deadline_ns:
            return True  # a babbling line has an end too
