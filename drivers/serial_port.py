"""A serial port as a file descriptor that wakes its reader: every byte is read as soon as it has arrived."""

from __future__ import annotations

import os
import select
import time
from contextlib import suppress

import serial

FULL = "the port takes no more bytes, nobody reads at its other end"
_RECEIVE_BYTES = 4096
_MOST_LINKS = 40
# Links to pseudo-terminals that hung up while they were open here: inode and time of making [ns].
_hung_up: dict[str, tuple[int, int]] = {}


class SerialPort:
    """A serial port, 8N1, raw, locked for this program and open once made. Every method may raise OSError."""

    def __init__(self, path: str, baud: int, timeout_s: float) -> None:
        """Open the port.

        Args:
            path: path of the port.
            baud: baud rate [bit/s].
            timeout_s: timeout of a write [s].

        A pseudo-terminal that hung up never comes back, and its number becomes another program's terminal: a
        link to one that hung up while it was open here is not followed until it is made anew.
        """
        self._path, self._link = path, _link_of(path)
        if self._link is not None and _hung_up.get(path) == self._link:
            raise OSError(f"{path} still leads to {os.readlink(path)}, which hung up: start the device again")
        self._port = serial.Serial(path, baud, timeout=0, write_timeout=timeout_s, exclusive=True)
        with suppress(OSError, ValueError, NotImplementedError):  # FTDI: 1 ms instead of 16
            self._port.set_low_latency_mode(True)
        self._fd = self.descriptor = self._port.fileno()
        self._poll = select.poll()
        self._poll.register(self._fd, select.POLLIN)

    def send(self, data: bytes) -> None:
        """Send all of `data`."""
        write_all(self._fd, data)

    def receive(self, deadline_s: float) -> bytes:
        """Return what has arrived, as soon as something has; empty at `deadline_s` (monotonic clock)."""
        remaining_s = deadline_s - time.monotonic()
        if not self._poll.poll(max(0.0, 1e3 * remaining_s)):
            return b""
        data = os.read(self._fd, _RECEIVE_BYTES)
        if not data:
            raise OSError("the other end hung up")
        return data

    def close(self) -> None:
        """Close the port. Never raises."""
        with suppress(OSError):
            if self._link is not None and any(event & select.POLLHUP for _, event in self._poll.poll(0)):
                _hung_up[self._path] = self._link
        with suppress(OSError):
            self._port.close()


def _link_of(path: str) -> tuple[int, int] | None:
    """Return what tells the last link on the way to a pseudo-terminal from one made anew; None: there is none."""
    status = None
    try:
        for _ in range(_MOST_LINKS):
            if not os.path.islink(path):
                break
            status = os.lstat(path)
            path = os.path.normpath(os.path.join(os.path.dirname(path), os.readlink(path)))
    except OSError:
        return None
    return (status.st_ino, status.st_mtime_ns) if status and path.startswith("/dev/pts/") else None


def write_all(fd: int, data: bytes) -> int:
    """Write `data` at once or not at all; its length. Raises OSError.

    pyserial's own write waits for the port after it has written, and calls it a time-out when the machine was busy.
    """
    try:
        written = os.write(fd, data)
    except BlockingIOError:
        written = 0
    if written != len(data):
        raise OSError(FULL)
    return written
