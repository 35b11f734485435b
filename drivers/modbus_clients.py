"""Modbus transactions on a serial port or a TCP connection, woken by the bytes; nothing is asked for twice.

pymodbus's own clients poll a serial port every millisecond or more (2.2 ms a transaction on a pty) and take 55 us
around each exchange on TCP; both turn an error of the system into a sentence in a log.
"""

from __future__ import annotations

import socket
import struct
import time

from drivers.compiled.exchange import attach
from drivers.modbus_frames import from_rtu, from_tcp, to_rtu, to_tcp
from drivers.serial_port import FULL, SerialPort
from rtctl.border.wire.wire_memory import TIMEOUT_NS, TRANSACTION, WireMemory

_RECEIVE_BYTES = 4096


class RtuClient:
    """A client of Modbus RTU, 8N1. A late reply could answer a later request, so what arrived before one is drained."""

    full = FULL

    def __init__(self, port: str, baud: int, timeout_s: float, memory: WireMemory) -> None:
        """Make a client that is not connected; `memory` learns the descriptor, for the compiled exchange."""
        self._path, self._baud, self._timeout_s = port, baud, timeout_s
        self._port: SerialPort | None = None
        self._memory = memory
        memory.line[TIMEOUT_NS] = round(1e9 * timeout_s)

    def connect(self) -> None:
        """Open the port unless it is open. Raises OSError."""
        if self._port is None:
            self._port = SerialPort(self._path, self._baud, self._timeout_s)
            attach(self._memory, self._port.descriptor)

    def disconnect(self) -> None:
        """Close the port. Never raises."""
        attach(self._memory, -1)
        if self._port is not None:
            self._port.close()
        self._port = None

    def forget(self) -> None:
        """Do nothing after a failed transaction: the next one drains the line before it sends."""

    def transact(self, unit: int, request: bytes) -> bytes | None:
        """Take one transaction; return the reply's function code and body, or None: no valid one in time.

        Raises OSError.
        """
        self.connect()
        port = self._port
        assert port is not None
        deadline_s = time.monotonic() + self._timeout_s
        while port.receive(0.0) and time.monotonic() < deadline_s:  # a babbling line has an end too
            pass
        port.send(to_rtu(unit, request))
        arrived = b""
        while data := port.receive(deadline_s):
            arrived += data
            reply = from_rtu(unit, arrived)
            if reply is not None:
                return reply
        return None


class TcpClient:
    """A client of Modbus TCP. A connection whose transaction failed is given up, and its late reply with it."""

    full = "the connection takes no more bytes, nobody reads at its other end"

    def __init__(self, host: str, port: int, timeout_s: float, memory: WireMemory) -> None:
        """Make a client that is not connected; `memory` learns the descriptor and counts the transactions."""
        self._address, self._timeout_s = (host, port), timeout_s
        self._socket: socket.socket | None = None
        self._memory = memory
        memory.line[TIMEOUT_NS] = round(1e9 * timeout_s)
        memory.line[TRANSACTION] = 0

    def connect(self) -> None:
        """Connect unless connected. Raises OSError."""
        if self._socket is None:
            self._socket = socket.create_connection(self._address, timeout=self._timeout_s)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.settimeout(None)
            seconds = int(self._timeout_s)  # the kernel's own timeout: one call less than to poll first
            wait = struct.pack("@ll", seconds, max(1, round(1e6 * (self._timeout_s - seconds))))
            for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
                self._socket.setsockopt(socket.SOL_SOCKET, option, wait)
            attach(self._memory, self._socket.fileno())

    def disconnect(self) -> None:
        """Close the connection. Never raises."""
        attach(self._memory, -1)
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def forget(self) -> None:
        """Disconnect after a failed transaction: the next one makes a connection of its own."""
        self.disconnect()

    def transact(self, unit: int, request: bytes) -> bytes | None:
        """Take one transaction; return the reply's function code and body, or None: no valid one in time.

        Raises OSError.
        """
        self.connect()
        connection = self._socket
        assert connection is not None
        transaction = (int(self._memory.line[TRANSACTION]) + 1) & 0xFFFF
        self._memory.line[TRANSACTION] = transaction
        deadline_s = time.monotonic() + self._timeout_s
        frame = to_tcp(transaction, unit, request)
        if connection.send(frame) != len(frame):
            raise OSError(self.full)
        arrived = b""
        while time.monotonic() < deadline_s:
            try:
                data = connection.recv(_RECEIVE_BYTES)
            except BlockingIOError:  # in time nothing has come
                return None
            if not data:
                raise OSError("the other end hung up")
            arrived += data
            try:
                while (reply := from_tcp(arrived)) is not None:
                    if (reply.transaction, reply.unit) == (transaction, unit):
                        return reply.pdu
                    arrived = arrived[reply.used :]  # another transaction's
            except ValueError:
                return None
        return None
