"""Driver of a microcontroller on the plain serial protocol: COBS frames, CRC-16, float32 (docs/serial-protocol.md).

Every request has a number that its reply repeats. What arrives with another number, or damaged, is thrown away and
the line listened to further, so noise and late replies cost no more than the time they take; an answer that never
comes is a fault at the timeout.

Pipelined, `exchange` k sends command k and returns the answer to command k - `pipeline`: a wire may then take
`pipeline` periods longer than it otherwise could, and the reading is so many periods older.
"""

from __future__ import annotations

import secrets
import struct
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

from drivers.compiled.exchange import LineExchange, attach, line_exchange, system_error
from drivers.compiled.serial import exchange_serial
from drivers.line_errors import lost
from drivers.serial_port import FULL as NO_ROOM
from drivers.serial_port import SerialPort
from rtctl.border.errors import DriverError, Fault, InputError
from rtctl.border.records import DeviceProfile, DeviceStatus, Measurement, SwitchedOff
from rtctl.border.wire.serial_frames import (
    ERROR,
    REPLY,
    VERSION,
    ErrorCode,
    FrameReader,
    Layout,
    Message,
    Request,
    Settings,
    frame,
    identity_of,
    settings_of,
    settings_payload,
)
from rtctl.border.wire.wire_memory import (
    DAMAGED,
    FULL,
    OK,
    REPLY_AT,
    REPLY_LENGTH,
    SEQUENCE,
    SILENT,
    STALE,
    SYSTEM,
    TIMEOUT_NS,
    CompiledExchange,
    wire_memory,
)
from rtctl.border.wire.wire_memory import REPLY as REPLY_CODE

_REFUSED = int(DeviceStatus.REFUSED)
_UINT32 = 0xFFFFFFFF


class _Asked(NamedTuple):
    """A request under way."""

    kind: Request
    tag: int


class SerialDriver:
    """A driver of one device at the end of a serial line."""

    def __init__(
        self,
        *,
        port: str,
        baud: int,
        profile: DeviceProfile,
        pipeline: int = 0,
        first_tag: int | None = None,
        compiled: bool = True,
    ) -> None:
        """Make a driver that is closed.

        Args:
            port: path of the serial port, 8N1.
            baud: baud rate [bit/s].
            profile: names and units of the device's channels.
            pipeline: how many answers may be under way when a command is sent.
            first_tag: number of the first request; None: any, so that no answer to an earlier program fits.
            compiled: whether the exchange is compiled; never so if pipelined.
        """
        if pipeline < 0:
            raise InputError(f"serial {port}: pipeline must be 0 or more periods, got {pipeline!r}")
        self.profile = profile
        self.identity = ""
        self._path, self._baud, self._pipeline = port, baud, pipeline
        self._name = f"serial {port}"
        self._layout = Layout(profile)
        self._reader = FrameReader()
        self._memory = wire_memory(profile)
        self._memory.line[SEQUENCE] = (secrets.randbelow(1 << 16) if first_tag is None else first_tag) - 1
        self._compiles = compiled and not pipeline
        self._compiled: LineExchange | None = None
        self._waiting: deque[Message] = deque()  # arrived, not looked at yet
        self._sent: deque[_Asked] = deque()  # without an answer yet, oldest first
        self._settings = Settings(0, 0, 0, 0)
        self._port: SerialPort | None = None
        self._timeout_s = 0.0

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """Connect, set clock [us] and watchdog [ms], re-arm, read once. `timeout_s` is for one answer.

        May be called again after a fault: reconnects. Raises DriverError; then nothing stays open.
        """
        if not 0 <= watchdog_ms <= 0xFFFF:
            raise InputError(f"{self._name}: watchdog must be 0 (none) to 65535 ms, got {watchdog_ms!r} ms")
        lockstep = lockstep_period_us is not None
        if lockstep and self._pipeline:
            raise InputError(f"{self._name}: pipeline = {self._pipeline} needs a free-running device")
        if not 0 <= (lockstep_period_us or 0) <= _UINT32:
            raise InputError(
                f"{self._name}: the period must be 0 to {_UINT32} us, got {lockstep_period_us} us"
            )
        self._disconnect()
        self._compile()
        self._timeout_s = timeout_s
        self._memory.line[TIMEOUT_NS] = round(1e9 * timeout_s)
        try:
            self._port = SerialPort(self._path, self._baud, timeout_s)
        except OSError as error:
            raise lost(self._name, error, timeout_s) from None
        attach(self._memory, self._port.descriptor)
        try:
            self._identify()
            for enable in (0, 1):
                self._set(Settings(enable, int(lockstep), watchdog_ms, lockstep_period_us or 0))
            first = self._reading(self._ask(Request.READ))
        except DriverError:
            self._disconnect()
            raise
        if (self._memory.line[SEQUENCE] + 1) & 0xFFFF == first.sequence:
            self._memory.line[SEQUENCE] += 1  # the number in force would count for nothing
        return first

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Command `levels` (profile's units); the answer, to the command `pipeline` calls ago. Raises DriverError."""
        if self._compiled is None or self._port is None:
            return self._exchange_readable(levels)
        return self.conclude(self._compiled.run(levels), levels)

    def compiled_exchange(self) -> CompiledExchange | None:
        """Return the exchange for a compiled loop; None if it cannot be called without Python."""
        compiled = self._compile()
        return None if compiled is None else compiled.compiled_exchange(self.conclude)

    def _compile(self) -> LineExchange | None:
        """Compile the exchange, or load it: before the device is armed, since it may last seconds."""
        if self._compiles and self._compiled is None:
            self._compiled = line_exchange(exchange_serial, self._memory)
        return self._compiled

    def conclude(self, ended: int, levels: Sequence[float]) -> Measurement:
        """Return the measurement of a compiled exchange, or raise DriverError as the one in Python does."""
        memory, compiled = self._memory, self._compiled
        assert compiled is not None
        if ended == OK:
            return compiled.measurement()
        asked = _Asked(Request.COMMAND, int(memory.line[SEQUENCE]))
        if ended in (SYSTEM, FULL):
            raise self._lost(system_error(memory) if ended == SYSTEM else OSError(NO_ROOM))
        if ended == SILENT:
            raise self._silent_in_time(asked, int(memory.line[DAMAGED]))
        if ended == STALE:
            raise self._stale(asked, compiled.measurement())
        if ended == REPLY_CODE:
            at, length = memory.line[[REPLY_AT, REPLY_LENGTH]]
            body = memory.inbox[at : at + length].tobytes()
            raise self._refused(asked, body[3:]) if body[0] == ERROR else self._of_another_length()
        self._payload(levels)  # raises, with the reason
        raise AssertionError(f"an exchange ended as {ended}, which nothing explains")

    def _payload(self, levels: Sequence[float]) -> bytes:
        try:
            return self._layout.command(levels)
        except (OverflowError, struct.error) as error:
            raise DriverError(
                Fault.COMMAND_REFUSED, f"{self._name}: command {_text(levels, self.profile)}: {error}"
            ) from None

    def _exchange_readable(self, levels: Sequence[float]) -> Measurement:
        """Exchange in Python: the oracle of the compiled one, and for pipelined lines."""
        payload = self._payload(levels)
        if self._pipeline and not self._sent:  # the first one: so many exchanges need answers of their own
            self._sent.extend([self._ask(Request.READ) for _ in range(self._pipeline)])
        self._sent.append(self._ask(Request.COMMAND, payload))
        asked = self._sent.popleft()
        measurement = self._reading(asked)
        if asked.kind == Request.READ or measurement.sequence == asked.tag or measurement.status & _REFUSED:
            return measurement
        raise self._stale(asked, measurement)

    def _stale(self, asked: _Asked, measurement: Measurement) -> DriverError:
        return DriverError(
            Fault.STALE_REPLY,
            f"{self._name}: command number {measurement.sequence} is in force, sent was {asked.tag}: another program "
            "commands this device too, or it has restarted",
        )

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff:
        """Command `safe_levels`, disable, disconnect: as far as the wire carries it. Never raises."""
        acknowledged = SwitchedOff.SILENT
        if self._port is None:
            return acknowledged
        with suppress(DriverError):
            answer = self.exchange(safe_levels)
            if not (self._pipeline or answer.status & _REFUSED):  # pipelined, it answers an earlier command
                acknowledged = SwitchedOff.SAFE
        with suppress(DriverError):
            self._set(self._settings._replace(enable=0))
            acknowledged = SwitchedOff.OFF
        self._disconnect()
        return acknowledged

    def _identify(self) -> None:
        identity = identity_of(self._answer(self._ask(Request.IDENTIFY)).payload)
        wanted = (VERSION, len(self.profile.commands), len(self.profile.sensed))
        if identity is None or identity[:3] != wanted:
            answer_text = "an identity of another length" if identity is None else f"{identity[:3]}"
            raise DriverError(
                Fault.COMMAND_REFUSED,
                f"{self._name}: protocol version, commands and readings should be {wanted}, the device "
                f"answers {answer_text}: is it of kind {self.profile.kind}?",
            )
        self.identity = identity.name

    def _set(self, settings: Settings) -> None:
        applied = settings_of(self._answer(self._ask(Request.SETTINGS, settings_payload(settings))).payload)
        self._settings = settings
        if applied is None or applied[:3] != settings[:3]:
            no_lockstep = applied is not None and applied.lockstep < settings.lockstep
            hint = '; it has no lockstep: set clock.mode = "live"' if no_lockstep else ""
            raise DriverError(
                Fault.COMMAND_REFUSED,
                f"{self._name}: asked for {settings}, the device has set {applied}{hint}",
            )

    def _ask(self, kind: Request, payload: bytes = b"") -> _Asked:
        """Send one request."""
        if self._port is None:
            raise DriverError(Fault.CONNECTION_LOST, f"{self._name}: is not open")
        tag = (int(self._memory.line[SEQUENCE]) + 1) & 0xFFFF
        self._memory.line[SEQUENCE] = tag  # never sent twice, whatever comes of it
        try:
            self._port.send(frame(kind, tag, payload))
        except OSError as error:
            raise self._lost(error) from None
        return _Asked(kind, tag)

    def _answer(self, asked: _Asked) -> Message:
        """Return the answer to a request; drop what is damaged or has another number. Raises DriverError."""
        deadline_s = time.monotonic() + self._timeout_s
        kind, damaged = asked.kind | REPLY, self._reader.damaged
        while True:
            while self._waiting:
                message = self._waiting.popleft()
                if message.tag == asked.tag and message.type == kind:
                    return message
                if message.tag == asked.tag and message.type == ERROR:
                    raise self._refused(asked, message.payload)
                if any(later.tag == message.tag for later in self._sent):
                    raise self._silent(asked, "though a later request has been answered")
            arrived = self._receive(deadline_s)
            if not arrived:
                raise self._silent_in_time(asked, self._reader.damaged - damaged)
            self._waiting.extend(self._reader.feed(arrived))

    def _receive(self, deadline_s: float) -> bytes:
        if self._port is None:
            raise DriverError(Fault.CONNECTION_LOST, f"{self._name}: is not open")
        try:
            return self._port.receive(deadline_s)
        except OSError as error:
            raise self._lost(error) from None

    def _reading(self, asked: _Asked) -> Measurement:
        """Return the measurement that answers a command or a read. Raises DriverError."""
        measurement = self._layout.measurement(self._answer(asked).payload)
        if measurement is None:
            raise self._of_another_length()
        return measurement

    def _of_another_length(self) -> DriverError:
        return DriverError(
            Fault.COMMAND_REFUSED,
            f"{self._name}: the reading has another length: is this device of kind {self.profile.kind}?",
        )

    def _refused(self, asked: _Asked, payload: bytes) -> DriverError:
        code = payload[0] if payload else 0
        known = {error.value: error.name.lower().replace("_", " ") for error in ErrorCode}
        return DriverError(
            Fault.COMMAND_REFUSED,
            f"{self._name}: {asked.kind.name.lower()} {asked.tag} was answered with error {code} "
            f"({known.get(code, 'unknown')})",
        )

    def _silent(self, asked: _Asked, how: str) -> DriverError:
        what = f"no answer to {asked.kind.name.lower()} {asked.tag}"
        return DriverError(Fault.NO_ANSWER, f"{self._name}: {what} {how}")

    def _silent_in_time(self, asked: _Asked, damaged: int) -> DriverError:
        return self._silent(
            asked,
            f"within {1e3 * self._timeout_s:g} ms ({damaged} damaged frames); is the device on, is the baud rate "
            "right, is the timeout long enough?",
        )

    def _lost(self, error: OSError) -> DriverError:
        self._disconnect()
        return lost(self._name, error, self._timeout_s)

    def _disconnect(self) -> None:
        attach(self._memory, -1)
        if self._port is not None:
            self._port.close()
        self._port = None
        self._reader = FrameReader()
        self._waiting.clear()
        self._sent.clear()


def _text(levels: Sequence[float], profile: DeviceProfile) -> str:
    return ", ".join(
        f"{level:g} {channel.unit}" for level, channel in zip(levels, profile.commands, strict=False)
    )
