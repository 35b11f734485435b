"""pymodbus's synchronous clients, woken by the bytes instead of polling, with errors that keep a cause.

pymodbus's serial client looks for bytes every millisecond or more, which makes a transaction on a pty last
2.2 ms instead of 0.15, and both clients turn an error of the system into a sentence in a log.
"""

from __future__ import annotations

import logging
import os
import select
import socket
import time
from contextlib import suppress

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from drivers.serial_port import write_all

# what pymodbus logs is in our exceptions; without a handler Python would print it as well
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

_RECEIVE_BYTES = 4096


class PromptSerialClient(ModbusSerialClient):
    """Modbus RTU, 8N1. A late reply may answer a later request: what has arrived by then is drained."""

    def __init__(self, port: str, baud: int, timeout_s: float) -> None:
        super().__init__(port, baudrate=baud, timeout=timeout_s, retries=0)
        self._timeout_s = timeout_s
        self._deadline_s = 0.0
        self._poll = select.poll()

    def connect(self) -> bool:
        """Open the port unless it is open. Raises OSError."""
        if self.socket is None:
            params = self.comm_params
            self.socket = serial.Serial(
                params.host,
                params.baudrate,
                timeout=0,
                write_timeout=self._timeout_s,
                exclusive=True,
            )
            with suppress(OSError, ValueError, NotImplementedError):  # FTDI: 1 ms instead of 16
                self.socket.set_low_latency_mode(True)
            self._poll = select.poll()
            self._poll.register(self.socket.fileno(), select.POLLIN)
        return True

    def disconnect(self) -> None:
        """Close the port."""
        if self.socket is not None:
            with suppress(OSError):
                self.socket.close()
        self.socket = None

    def forget(self) -> None:
        """Nothing to do after a failed transaction: the next one drains the line before it sends."""

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Drain, then write. Raises OSError."""
        if self.socket is None:
            raise ConnectionException("the port is closed")
        self._deadline_s = time.monotonic() + self._timeout_s
        while self._poll.poll(0) and time.monotonic() < self._deadline_s:  # a babbling line has an end too
            self._read_some()
        return write_all(self.socket.fileno(), request)

    def recv(self, size: int | None) -> bytes:
        """What has arrived, as soon as something has; empty at the request's deadline. Raises OSError."""
        remaining_s = self._deadline_s - time.monotonic()
        if remaining_s <= 0.0 or not self._poll.poll(1e3 * remaining_s):
            return b""
        return self._read_some()

    def _read_some(self) -> bytes:
        if self.socket is None:
            raise ConnectionException("the port is closed")
        data = os.read(self.socket.fileno(), _RECEIVE_BYTES)
        if not data:
            raise ConnectionException("the other end hung up")
        return data


class PromptTcpClient(ModbusTcpClient):
    """Modbus TCP. A connection whose transaction failed is given up, and its late reply with it."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        super().__init__(host, port=port, timeout=timeout_s, retries=0)
        self._timeout_s = timeout_s
        self._deadline_s = 0.0

    def connect(self) -> bool:
        """Connect unless connected. Raises OSError."""
        if self.socket is None:
            address = (self.comm_params.host, self.comm_params.port)
            self.socket = socket.create_connection(address, timeout=self._timeout_s)
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return True

    def disconnect(self) -> None:
        """Close the connection."""
        if self.socket is not None:
            self.socket.close()
        self.socket = None

    def forget(self) -> None:
        """After a failed transaction: the next one makes a connection of its own."""
        self.disconnect()

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Write. Raises OSError."""
        if self.socket is None:
            raise ConnectionException("the connection is closed")
        self._deadline_s = time.monotonic() + self._timeout_s
        self.socket.settimeout(self._timeout_s)
        self.socket.sendall(request)
        return len(request)

    def recv(self, size: int | None) -> bytes:
        """What has arrived, as soon as something has; empty at the request's deadline. Raises OSError."""
        remaining_s = self._deadline_s - time.monotonic()
        if self.socket is None or remaining_s <= 0.0:
            return b""
        self.socket.settimeout(remaining_s)
        try:
            data = self.socket.recv(_RECEIVE_BYTES)
        except TimeoutError:
            return b""
        if not data:
            raise ConnectionException("the other end hung up")
        return data
