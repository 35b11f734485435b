"""What carries text to an instrument and back: a TCP socket, a serial port or a VISA resource, with the same verbs."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple, Protocol, cast

from drivers.serial_port import SerialPort, write_all

_RECEIVE_BYTES = 4096
LINGER_S = 0.5
"""How long a closing connection waits for the other end: closed at once, with answers unread, it would be reset, and
the last command, which switches the output off, might be lost with it."""


class Port(Protocol):
    """One end of a line. Every method but `close` may raise OSError."""

    @property
    def descriptor(self) -> int | None:
        """File descriptor; None: it has none."""
        ...

    def send(self, data: bytes) -> None:
        """Send all of `data`, whole lines."""
        ...

    def receive(self, deadline_s: float) -> bytes:
        """Return what has arrived, as soon as something has; empty at `deadline_s` (monotonic clock)."""
        ...

    def close(self) -> None:
        """Close it, once all that was sent has left. Never raises."""
        ...


class TcpPort:
    """A TCP connection, open once made."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        """Connect within `timeout_s` [s]. Raises OSError."""
        self._socket = socket.create_connection((host, port), timeout=timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)
        self.descriptor: int | None = self._socket.fileno()
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)

    def send(self, data: bytes) -> None:
        """See `Port`."""
        write_all(self._socket.fileno(), data)

    def receive(self, deadline_s: float) -> bytes:
        """See `Port`."""
        if not self._poll.poll(max(0.0, 1e3 * (deadline_s - time.monotonic()))):
            return b""
        data = self._socket.recv(_RECEIVE_BYTES)
        if not data:
            raise ConnectionResetError("the other end closed the connection")
        return data

    def close(self) -> None:
        """See `Port`."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            deadline_s = time.monotonic() + LINGER_S
            while time.monotonic() < deadline_s and self.receive(deadline_s):
                pass
        self._socket.close()


class VisaPort:
    """A VISA resource, open once made; each line is a message of its own."""

    def __init__(self, resource: str, library: str, timeout_s: float) -> None:
        """Open `resource` by the VISA library `library` ("": pyvisa's own choice). Raises OSError."""
        import pyvisa

        self.descriptor: int | None = None
        self._error: Any = pyvisa.errors.Error
        self._timeouts = pyvisa.constants.StatusCode.error_timeout
        try:
            manager = pyvisa.ResourceManager(library)
            self._resource = cast(Any, manager.open_resource(resource, open_timeout=round(1e3 * timeout_s)))
        except (self._error, ValueError, LookupError, OSError) as error:
            raise _told(error) from None
        if not isinstance(self._resource, pyvisa.resources.MessageBasedResource):
            self.close()
            raise OSError("no VISA resource that takes messages, such as GPIB0::24::INSTR")
        self._resource.read_termination = self._resource.write_termination = "\n"

    def send(self, data: bytes) -> None:
        """See `Port`."""
        try:
            for line in data.splitlines(keepends=True):
                self._resource.write_raw(line)
        except self._error as error:
            raise _told(error) from None

    def receive(self, deadline_s: float) -> bytes:
        """See `Port`."""
        remaining_ms = 1e3 * (deadline_s - time.monotonic())
        self._resource.timeout = max(1.0, remaining_ms)
        try:
            data: bytes = self._resource.read_raw()
        except self._error as error:
            if getattr(error, "error_code", None) == self._timeouts:
                return b""
            raise _told(error) from None
        return data.removesuffix(b"\n") + b"\n"  # a message ends even where its terminator was taken off

    def close(self) -> None:
        """See `Port`."""
        with suppress(self._error, OSError):
            self._resource.close()


def _told(error: Exception) -> OSError:
    """Return an error of the VISA library as one line."""
    return OSError(f"VISA: {' '.join(str(error).split())}")


class Place(NamedTuple):
    """Where an instrument is reached."""

    name: str
    """As messages name it."""
    connect: Callable[[float], Port]
    """Opens the port, within a time [s]. Raises OSError."""


def tcp_place(address: str) -> Place:
    """Return HOST:PORT, an IPv6 host in brackets, as a place."""
    host, _, port = address.rpartition(":")
    return Place(address, lambda timeout_s: TcpPort(host.strip("[]"), int(port), timeout_s))


def serial_place(path: str, baud: int) -> Place:
    """Return a serial port with its baud rate [bit/s] as a place."""
    return Place(path, lambda timeout_s: SerialPort(path, baud, timeout_s))


def visa_place(resource: str, library: str) -> Place:
    """Return a VISA resource, such as GPIB0::24::INSTR, as a place; `library` "": pyvisa's own choice."""
    return Place(resource, lambda timeout_s: VisaPort(resource, library, timeout_s))
