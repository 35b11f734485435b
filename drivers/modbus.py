"""Drivers of a device on a Modbus wire: one exchange is one transaction of function 23.

A device without function 23 (exception 1) is driven with 16, then 3, from then on. A reply counts only if
the sequence number in force (register 109) is that of the command just sent, or if the device says that it
refused.

Commands beyond the first lie behind the settings (enable, watchdog, clock, period: registers 3-7). To stay one
transaction the write then runs over the settings as well and repeats them as the device gave them back at opening.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from contextlib import suppress

from drivers.compiled.exchange import Kernel, LineExchange, line_exchange
from drivers.compiled.modbus import exchange_rtu, exchange_tcp
from drivers.modbus_clients import RtuClient, TcpClient
from drivers.modbus_line import ILLEGAL_FUNCTION, Client, ExceptionReply, ModbusLine
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceProfile, DeviceStatus, Measurement, SwitchedOff
from rtctl.border.wire.registers import (
    CLOCK,
    COMMAND,
    COUNTER,
    ENABLE,
    FURTHER_COMMANDS,
    IDENTITY,
    IDENTITY_COUNT,
    READING,
    SEQUENCE_IN_FORCE,
    STATUS,
    TIME_US,
    WATCHDOG_MS,
    check_layout,
    float32_words,
    reading_count,
    uint32_words,
    words_identity,
)
from rtctl.border.wire.wire_memory import (
    OK,
    OVERFLOW,
    REGISTERS,
    SENSED_AT,
    SETTINGS,
    UNIT,
    CompiledExchange,
    WireMemory,
    wire_memory,
)
from rtctl.border.wire.wire_memory import SEQUENCE as SEQUENCE_SLOT

_REFUSED = int(DeviceStatus.REFUSED)
_FLOAT32, _WORD = struct.Struct(">f"), struct.Struct(">H")
_COUNTER_STATUS_TIME = struct.Struct(">IHI")
_COUNTER_AT, _SEQUENCE_AT = 2 * (COUNTER - READING), 2 * (SEQUENCE_IN_FORCE - READING)
assert (STATUS, TIME_US) == (COUNTER + 2, COUNTER + 3)  # they are unpacked in one go


class ModbusDriver:
    """A driver over any Modbus client; use it through the two classes below."""

    def __init__(
        self,
        make_client: Callable[[float, WireMemory], Client],
        name: str,
        unit: int,
        profile: DeviceProfile,
        kernel: Kernel | None,
    ) -> None:
        """Make a driver that is closed.

        Args:
            make_client: returns the client for a timeout [s].
            name: port or address, for messages.
            unit: Modbus unit.
            profile: names and units of the device's channels.
            kernel: the compiled exchange; None: the exchange is taken in Python.
        """
        check_layout(profile)
        self.profile = profile
        self._reading_count = reading_count(profile)
        self._sensed_at = [2 * (channel.register - READING) for channel in profile.sensed]
        self._reference_at = 2 * (profile.reference.register - READING)
        self.identity = ""
        self._make_client = make_client
        self._name = name
        self._unit = unit
        self._line: ModbusLine | None = None
        self._has_function_23 = True
        self._kernel = kernel
        self._compiled: LineExchange | None = None
        self._memory = memory = wire_memory(profile)
        places = [*self._sensed_at, self._reference_at]
        memory.line[SENSED_AT : SENSED_AT + len(places)] = places
        memory.line[REGISTERS], memory.line[UNIT] = self._reading_count, unit

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """Connect, set clock [us] and watchdog [ms], re-arm, read once. `timeout_s` is for one transaction.

        Raises DriverError; then nothing stays open.
        """
        if not 0 <= watchdog_ms <= 0xFFFF:
            raise InputError(f"{self._name}: watchdog must be 0 (none) to 65535 ms, got {watchdog_ms!r} ms")
        self._compile()
        client = self._make_client(timeout_s, self._memory)
        self._line = line = ModbusLine(client, self._name, self._unit, timeout_s)
        try:
            line.connect()
            self._set_up(line, lockstep_period_us, watchdog_ms)
            self.identity = _read_identity(line)
            first = self._measurement(line.read(READING, self._reading_count))
        except ExceptionReply as reply:
            self._disconnect()
            raise DriverError(
                Fault.COMMAND_REFUSED, f"{line.name}: {reply}: is this device of kind {self.profile.kind}?"
            ) from None
        except DriverError:
            self._disconnect()
            raise
        self._memory.line[SEQUENCE_SLOT] = first.sequence
        return first

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Command `levels` (profile's units) and read. Raises DriverError."""
        line = self._line
        if line is None:
            raise DriverError(Fault.CONNECTION_LOST, f"{self._name}: is not open")
        if self._compiled is None or not self._has_function_23:
            sequence = self._next_sequence()
            return self._believed(line, levels, lambda: self._exchange_readable(line, levels, sequence))
        line.connect()
        return self.conclude(self._compiled.run(levels), levels)

    def conclude(self, ended: int, levels: Sequence[float]) -> Measurement:
        """Return the measurement of a compiled exchange, or raise DriverError as the one in Python does."""
        line, compiled = self._line, self._compiled
        assert line is not None
        assert compiled is not None
        if ended == OK:
            return compiled.measurement()
        return self._believed(line, levels, lambda: self._explained(line, ended, levels))

    def compiled_exchange(self) -> CompiledExchange | None:
        """Return the exchange for a compiled loop; None if it cannot be called without Python."""
        compiled = self._compile()
        return (
            None
            if compiled is None or not self._has_function_23
            else compiled.compiled_exchange(self.conclude)
        )

    def _compile(self) -> LineExchange | None:
        """Compile the exchange, or load it: before the device is armed, since it may last seconds."""
        if self._kernel is not None and self._compiled is None:
            self._compiled = line_exchange(self._kernel, self._memory)
        return self._compiled

    def _believed(
        self, line: ModbusLine, levels: Sequence[float], take: Callable[[], Measurement]
    ) -> Measurement:
        """Return what `take` returns, if it answers the last command. Raises DriverError."""
        try:
            measurement = take()
        except (ExceptionReply, OverflowError) as refusal:
            asked = ", ".join(
                f"{level:g} {channel.unit}"
                for level, channel in zip(levels, self.profile.commands, strict=True)
            )
            raise DriverError(Fault.COMMAND_REFUSED, f"{line.name}: command {asked}: {refusal}") from None
        sequence = int(self._memory.line[SEQUENCE_SLOT])
        if measurement.sequence != sequence and not measurement.status & _REFUSED:
            raise DriverError(
                Fault.STALE_REPLY,
                f"{line.name}: command number {measurement.sequence} is in force, sent was {sequence}: "
                "the reply is a late one and not used; a longer timeout may help",
            )
        return measurement

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff:
        """Command `safe_levels`, disable, disconnect: as far as the wire carries it. Never raises."""
        acknowledged = SwitchedOff.SILENT
        if self._line is None:
            return acknowledged
        with suppress(DriverError, ValueError):
            if not self.exchange(safe_levels).status & _REFUSED:
                acknowledged = SwitchedOff.SAFE
        with suppress(DriverError, ExceptionReply):
            self._line.write(ENABLE, [0])
            acknowledged = SwitchedOff.OFF
        self._disconnect()
        return acknowledged

    def _set_up(self, line: ModbusLine, lockstep_period_us: int | None, watchdog_ms: int) -> None:
        line.write(ENABLE, [0])
        if lockstep_period_us is None:
            line.write(CLOCK, [0])
        else:
            line.write(CLOCK, [1, *uint32_words(lockstep_period_us)])
        line.write(WATCHDOG_MS, [watchdog_ms])
        line.write(ENABLE, [1])
        if len(self.profile.commands) > 1:
            settings = struct.unpack(">5H", line.read(ENABLE, FURTHER_COMMANDS - ENABLE))
            self._memory.line[SETTINGS : SETTINGS + 5] = settings  # a command has to run over them

    def _next_sequence(self) -> int:
        """Return the next sequence number; none is sent twice, whatever happens."""
        sequence = (int(self._memory.line[SEQUENCE_SLOT]) + 1) & 0xFFFF
        self._memory.line[SEQUENCE_SLOT] = sequence
        return sequence

    def _exchange_readable(self, line: ModbusLine, levels: Sequence[float], sequence: int) -> Measurement:
        """Exchange in Python: the oracle of the compiled one, and for devices without function 23."""
        return self._measurement(self._command(line, self._words(levels, sequence)))

    def _explained(self, line: ModbusLine, ended: int, levels: Sequence[float]) -> Measurement:
        """Return the measurement of a compiled exchange that did not end well, or raise as the one in Python does."""
        sequence = int(self._memory.line[SEQUENCE_SLOT])
        if ended == OVERFLOW:
            return self._exchange_readable(line, levels, sequence)
        try:
            return self._measurement(line.explain(ended, self._memory, self._reading_count))
        except ExceptionReply as reply:
            if reply.code != ILLEGAL_FUNCTION:
                raise
            self._has_function_23 = False
        return self._exchange_readable(line, levels, sequence)

    def _words(self, levels: Sequence[float], sequence: int) -> list[int]:
        """Return registers from 0 on: first command, sequence number, then settings and further commands."""
        first, *further = levels
        words = [*float32_words(first), sequence]
        if further:
            words += self._memory.line[SETTINGS : SETTINGS + 5].tolist()
        for level in further:
            words += float32_words(level)
        return words

    def _command(self, line: ModbusLine, words: list[int]) -> bytes:
        if self._has_function_23:
            try:
                return line.write_then_read(COMMAND, words, READING, self._reading_count)
            except ExceptionReply as reply:
                if reply.code != ILLEGAL_FUNCTION:
                    raise
                self._has_function_23 = False
        line.write(COMMAND, words)
        return line.read(READING, self._reading_count)

    def _measurement(self, registers: bytes) -> Measurement:
        """Return the measurement in registers from 100 on."""
        counter, status, time_us = _COUNTER_STATUS_TIME.unpack_from(registers, _COUNTER_AT)
        return Measurement(
            tuple([_FLOAT32.unpack_from(registers, at)[0] for at in self._sensed_at]),
            _FLOAT32.unpack_from(registers, self._reference_at)[0],
            counter,
            time_us,
            _WORD.unpack_from(registers, _SEQUENCE_AT)[0],
            status,
        )

    def _disconnect(self) -> None:
        if self._line is not None:
            self._line.disconnect()
        self._line = None


class ModbusRtuDriver(ModbusDriver):
    """A driver of a device on a serial port, 8N1."""

    def __init__(
        self, *, port: str, baud: int, unit: int, profile: DeviceProfile, compiled: bool = True
    ) -> None:
        """Make a driver that is closed.

        Args:
            port: path of the serial port.
            baud: baud rate [bit/s].
            unit: Modbus unit.
            profile: names and units of the device's channels.
            compiled: whether the exchange is compiled.
        """
        super().__init__(
            lambda timeout_s, memory: RtuClient(port, baud, timeout_s, memory),
            f"modbus-rtu {port}",
            unit,
            profile,
            exchange_rtu if compiled else None,
        )


class ModbusTcpDriver(ModbusDriver):
    """A driver of a device behind a TCP address."""

    def __init__(
        self, *, host: str, port: int, unit: int, profile: DeviceProfile, compiled: bool = True
    ) -> None:
        """Make a driver that is closed; the exchange is compiled if `compiled`."""
        super().__init__(
            lambda timeout_s, memory: TcpClient(host, port, timeout_s, memory),
            f"modbus-tcp {host}:{port}",
            unit,
            profile,
            exchange_tcp if compiled else None,
        )


def _read_identity(line: ModbusLine) -> str:
    """Return the device's name, or "" if it has none."""
    try:
        return words_identity(struct.unpack(">8H", line.read(IDENTITY, IDENTITY_COUNT)))
    except ExceptionReply:
        return ""
