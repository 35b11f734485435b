"""One Modbus unit at the end of a line: requests that are answered, or fail with a cause and an advice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from pymodbus.exceptions import ModbusException, ModbusIOException
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadWriteMultipleRegistersRequest,
    WriteMultipleRegistersRequest,
)

from drivers.line_errors import lost
from rtctl.border.errors import DriverError, Fault

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
    """What a line needs of `drivers.modbus_clients`."""

    def connect(self) -> bool:
        """Raises OSError."""
        ...

    def disconnect(self) -> None:
        """Never raises."""
        ...

    def forget(self) -> None:
        """See to it that the late reply to a failed transaction answers no other."""
        ...

    def execute(self, no_response_expected: bool, request: ModbusPDU) -> ModbusPDU:
        """One transaction."""
        ...


class ExceptionReply(Exception):  # noqa: N818 - an answer of the device, not always a failure
    """The unit answered with a Modbus exception."""

    def __init__(self, function: int, code: int) -> None:
        name = _EXCEPTIONS.get(code, "unknown")
        super().__init__(f"function {function} was answered with exception {code} ({name})")
        self.code = code


class ModbusLine:
    """Transactions with one unit. `name` says in messages which port or address it is."""

    def __init__(self, client: Client, name: str, unit: int, timeout_s: float) -> None:
        self._client = client
        self._unit = unit
        self._timeout_s = timeout_s
        self.name = f"{name} unit {unit}"

    def connect(self) -> None:
        """Raises DriverError."""
        try:
            self._client.connect()
        except OSError as error:
            raise lost(self.name, error, self._timeout_s) from None

    def disconnect(self) -> None:
        """Never raises."""
        self._client.disconnect()

    def read(self, address: int, count: int) -> Sequence[int]:
        """Function 3. Raises DriverError, ExceptionReply."""
        reply = self._transact(ReadHoldingRegistersRequest(dev_id=self._unit, address=address, count=count))
        return self._registers(reply, count)

    def write(self, address: int, words: list[int]) -> None:
        """Function 16. Raises DriverError, ExceptionReply."""
        request = WriteMultipleRegistersRequest(dev_id=self._unit, address=address, registers=words)
        reply = self._transact(request)
        if (reply.address, reply.count) != (address, len(words)):
            raise self._stale(f"registers {reply.address}+{reply.count} instead of {address}+{len(words)}")

    def write_then_read(self, address: int, words: list[int], read_address: int, count: int) -> Sequence[int]:
        """Function 23: one transaction. Raises DriverError, ExceptionReply."""
        request = ReadWriteMultipleRegistersRequest(
            read_address=read_address,
            read_count=count,
            write_address=address,
            write_registers=words,
            dev_id=self._unit,
        )
        return self._registers(self._transact(request), count)

    def _transact(self, request: ModbusPDU) -> ModbusPDU:
        function = request.function_code
        try:
            reply = self._client.execute(False, request)
        except ModbusIOException:
            self._client.forget()
            raise DriverError(
                Fault.NO_ANSWER,
                f"{self.name}: no valid answer to function {function} within {1e3 * self._timeout_s:g} ms; "
                "is the device on, are baud rate and unit right, is the timeout long enough?",
            ) from None
        except (ModbusException, OSError) as error:
            self._client.disconnect()
            raise lost(self.name, error, self._timeout_s) from None
        if isinstance(reply, ExceptionResponse) and reply.function_code == function | 0x80:
            raise ExceptionReply(function, reply.exception_code)
        if reply.function_code != function:
            raise self._stale(f"function {reply.function_code & 0x7F} instead of {function}")
        return reply

    def _registers(self, reply: ModbusPDU, count: int) -> Sequence[int]:
        if len(reply.registers) != count:
            raise self._stale(f"{len(reply.registers)} registers instead of {count}")
        return reply.registers

    def _stale(self, what: str) -> DriverError:
        self._client.forget()
        return DriverError(
            Fault.STALE_REPLY,
            f"{self.name}: the reply carries {what}: it answers an older request and is not used; "
            f"a timeout above {1e3 * self._timeout_s:g} ms may help",
        )
