"""Errors of the system at a port or an address, as faults with an advice."""

from __future__ import annotations

import errno
import socket

from rtctl.border.errors import DriverError, Fault

_ADVICE = {
    errno.ENOENT: "no such port; plug the adapter in, or start the device (rtctl serve)",
    errno.EACCES: 'permission denied; join the group that owns the port (often "dialout")',
    errno.EAGAIN: "the port is in use by another program; close that first",
    errno.ECONNREFUSED: "connection refused, nothing listens there; start the device or correct the address",
    errno.EIO: "the other end of the port is gone; start the device again or replug the adapter",
}


def lost(name: str, error: Exception, timeout_s: float) -> DriverError:
    """Return the fault of `error` on the line `name`, where a connection may take `timeout_s` [s]."""
    number = error.errno if isinstance(error, OSError) else None
    if isinstance(error, TimeoutError):
        what = f"no connection within {1e3 * timeout_s:g} ms; is the address right, the device on?"
        return DriverError(Fault.NO_ANSWER, f"{name}: {what}")
    if isinstance(error, socket.gaierror):
        what = "unknown host; correct the address"
    else:
        what = _ADVICE.get(number or 0) or f"connection lost ({error}); check cable and device"
    return DriverError(Fault.CONNECTION_LOST, f"{name}: {what}")
