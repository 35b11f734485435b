"""One Modbus unit at the end of a line: requests that are answered, or fail with a cause and advice."""

from __future__ import annotations

import struct
from typing import Protocol

from drivers.compiled.exchange import system_error
from drivers.line_errors import lost
from drivers.modbus_frames import (
    EXCEPTION,
    WRITE_THEN_READ,
    read_request,
    write_request,
    write_then_read_request,
)
from rtctl.border.errors import DriverError, Fault
from rtctl.border.wire.wire_memory import FULL, REPLY_AT, REPLY_LENGTH, SILENT, SYSTEM, WireMemory

ILLEGAL_FUNCTION = 1

_EXCEPTIONS = {
    1: "illegal function",
    2: "illegal address",
    3: "illegal value",
    4: "device failure",
    6: "device busy",
    10: "gateway path unavailable",
    11: "gateway target failed to respond",
}


class Client(Protocol):
    """The protocol of a client (`drivers.modbus_clients`)."""

    full: str
    """The fault if bytes can no longer be sent."""

    def connect(self) -> None:
        """Connect, unless connected. Raises OSError."""
        ...

    def disconnect(self) -> None:
        """Disconnect. Never raises."""
        ...

    def forget(self) -> None:
        """See to it that the late reply to a failed transaction answers no other."""
        ...

    def transact(self, unit: int, request: bytes) -> bytes | None:
        """Take one transaction; return the reply's function code and body, or None: no valid one in time.

        Raises OSError.
        """
        ...


class ExceptionReply(Exception):  # noqa: N818 - an answer of the device, not always a failure
    """An answer that is a Modbus exception."""

    def __init__(self, function: int, code: int) -> None:
        name = _EXCEPTIONS.get(code, "unknown")
        super().__init__(f"function {function} was answered with exception {code} ({name})")
        self.code = code


class ModbusLine:
    """The line to one unit; `name` is its port or address, for messages."""

    def __init__(self, client: Client, name: str, unit: int, timeout_s: float) -> None:
        self._client = client
        self._unit = unit
        self._timeout_s = timeout_s
        self.name = f"{name} unit {unit}"

    def connect(self) -> None:
        """Connect. Raises DriverError."""
        try:
            self._client.connect()
        except OSError as error:
            raise lost(self.name, error, self._timeout_s) from None

    def disconnect(self) -> None:
        """Disconnect. Never raises."""
        self._client.disconnect()

    def read(self, address: int, count: int) -> bytes:
        """Read registers by function 3, high byte first. Raises DriverError, ExceptionReply."""
        return self._registers(self._transact(read_request(address, count)), count)

    def write(self, address: int, words: list[int]) -> None:
        """Write registers by function 16. Raises DriverError, ExceptionReply."""
        reply = self._transact(write_request(address, words))
        start, count = struct.unpack(">HH", reply) if len(reply) == 4 else (-1, 0)
        if (start, count) != (address, len(words)):
            raise self._stale(f"registers {start}+{count} instead of {address}+{len(words)}")

    def write_then_read(self, address: int, words: list[int], read_address: int, count: int) -> bytes:
        """Write, then read registers by function 23, in one transaction. Raises DriverError, ExceptionReply."""
        return self._registers(
            self._transact(write_then_read_request(address, words, read_address, count)), count
        )

    def _transact(self, request: bytes) -> bytes:
        """Return the reply's body. Raises DriverError, ExceptionReply."""
        try:
            reply = self._client.transact(self._unit, request)
        except OSError as error:
            raise self._lost(error) from None
        return self._body(request[0], reply)

    def explain(self, ended: int, memory: WireMemory, count: int) -> bytes:
        """Return the registers of a compiled function 23 that ended well. Raises DriverError, ExceptionReply."""
        if ended in (SYSTEM, FULL):
            raise self._lost(system_error(memory) if ended == SYSTEM else OSError(self._client.full))
        at, length = memory.line[[REPLY_AT, REPLY_LENGTH]]
        reply = None if ended == SILENT else memory.inbox[at : at + length].tobytes()
        return self._registers(self._body(WRITE_THEN_READ, reply), count)

    def _lost(self, error: OSError) -> DriverError:
        self._client.disconnect()
        return lost(self.name, error, self._timeout_s)

    def _body(self, function: int, reply: bytes | None) -> bytes:
        """Return the body of the reply to a request of `function`; None: there was no valid one in time."""
        if reply is None:
            self._client.forget()
            raise DriverError(
                Fault.NO_ANSWER,
                f"{self.name}: no valid answer to function {function} within {1e3 * self._timeout_s:g} ms; "
                "is the device on, are baud rate and unit right, is the timeout long enough?",
            )
        if reply[0] == function | EXCEPTION:
            raise ExceptionReply(function, reply[1] if len(reply) > 1 else 0)
        if reply[0] != function:
            raise self._stale(f"function {reply[0] & 0x7F} instead of {function}")
        return reply[1:]

    def _registers(self, reply: bytes, count: int) -> bytes:
        if len(reply) != 1 + 2 * count or reply[0] != 2 * count:
            raise self._stale(f"{len(reply) // 2} registers instead of {count}")
        return reply[1:]

    def _stale(self, what: str) -> DriverError:
        self._client.forget()
        return DriverError(
            Fault.STALE_REPLY,
            f"{self.name}: the reply carries {what}: it answers an older request and is not used; "
            f"a timeout above {1e3 * self._timeout_s:g} ms may help",
        )
