"""A simulated device on the plain serial protocol: bytes in, bytes out (docs/serial-protocol.md)."""

from __future__ import annotations

from math import isfinite

from plant_sim.device import SimulatedDevice
from rtctl.border.wire.serial_frames import (
    ERROR,
    REPLY,
    ErrorCode,
    FrameReader,
    Layout,
    Message,
    Request,
    Settings,
    frame,
    identity_payload,
    settings_of,
    settings_payload,
)


class SerialDevice:
    """The serial side of a device; a damaged frame is answered with silence."""

    def __init__(self, device: SimulatedDevice) -> None:
        self._device = device
        self._layout = Layout(device.profile)
        self._reader = FrameReader()

    def receive(self, data: bytes) -> bytes:
        """Return the replies to the requests that `data` completes."""
        return b"".join([self._answer(message) for message in self._reader.feed(data)])

    def _answer(self, message: Message) -> bytes:
        kind, tag, payload = message
        device = self._device
        if kind == Request.COMMAND:
            levels = self._layout.levels(payload)
            if levels is None:
                return _error(tag, ErrorCode.WRONG_LENGTH)
            if not all(map(isfinite, levels)):
                return _error(tag, ErrorCode.ILLEGAL_VALUE)
            return frame(kind | REPLY, tag, self._layout.reading(device.exchange(levels, tag)))
        if kind == Request.READ:
            return frame(kind | REPLY, tag, self._layout.reading(device.read()))
        if kind == Request.SETTINGS:
            settings = settings_of(payload)
            if settings is None:
                return _error(tag, ErrorCode.WRONG_LENGTH)
            return self._set(tag, settings)
        if kind == Request.IDENTIFY:
            return frame(kind | REPLY, tag, identity_payload(device.profile, device.identity))
        return _error(tag, ErrorCode.UNKNOWN_TYPE)

    def _set(self, tag: int, settings: Settings) -> bytes:
        """Check settings as a whole, then set watchdog, clock, enable, in the order of the register map."""
        enable, lockstep, watchdog_ms, period_us = settings
        if enable > 1 or lockstep > 1 or (lockstep and period_us == 0):
            return _error(tag, ErrorCode.ILLEGAL_VALUE)
        device = self._device
        device.set_watchdog(watchdog_ms)
        device.set_clock(lockstep=bool(lockstep), period_us=period_us)
        device.set_enable(bool(enable))
        now = Settings(device.enabled, device.lockstep, device.watchdog_ms, device.period_us)
        return frame(Request.SETTINGS | REPLY, tag, settings_payload(now))


def _error(tag: int, code: ErrorCode) -> bytes:
    return frame(ERROR, tag, bytes((code,)))
