"""The register map around a simulated device: words in, words out, whole writes or none.

A write is checked as a whole before anything of it takes effect. Then, whatever its order on the wire,
settings apply first (watchdog, clock), enable next and the command last. A level without its sequence
number is only latched; it takes effect when a fresh sequence number arrives. Command channels beyond the first
stand in registers 8-9, 10-11 and so on, as the profile says.
"""

from __future__ import annotations

import struct
from math import isfinite

from plant_sim.device import SimulatedDevice
from rtctl.border.records import Measurement
from rtctl.border.wire.registers import (
    CLOCK,
    COUNTER,
    ENABLE,
    IDENTITY,
    MAP_END,
    PERIOD_US,
    READING,
    SEQUENCE,
    SEQUENCE_IN_FORCE,
    STATUS,
    WATCHDOG_MS,
    check_layout,
    identity_words,
)

ILLEGAL_FUNCTION = 1
ILLEGAL_ADDRESS = 2
ILLEGAL_VALUE = 3

_SETTINGS = ">fHHHHI"
"""Registers 0-7: first command, sequence, enable, watchdog [ms], clock, sample period [us]; then further commands."""
_FLOAT32 = struct.Struct(">f")
_COUNTER_STATUS_TIME = struct.Struct(">IHI")
_WORD = struct.Struct(">H")


class Refusal(Exception):  # noqa: N818 - the protocol's answer to a request, no failure of ours
    """A refusal, answered with a Modbus exception; `code` is 1, 2 or 3."""

    def __init__(self, code: int) -> None:
        super().__init__(f"Modbus exception {code}")
        self.code = code


class RegisterFile:
    """The holding registers of a device; values are big-endian bytes, two per register."""

    def __init__(self, device: SimulatedDevice) -> None:
        check_layout(device.profile)
        self._device = device
        self._levels = device.off
        self._sequence = 0
        self._layout = struct.Struct(_SETTINGS + (len(self._levels) - 1) * "f")
        self._end = self._layout.size // 2
        identity = struct.pack(">8H", *identity_words(device.identity))
        self._blank = bytes(2 * (IDENTITY - READING)) + identity
        self._floats = [2 * (channel.register - READING) for channel in device.profile.sensed]
        self._reference = 2 * (device.profile.reference.register - READING)

    def power_cycle(self) -> None:
        """Restart the device; what was latched is forgotten with it."""
        self._device.power_cycle()
        self._levels, self._sequence = self._device.off, 0

    def check_readable(self, address: int, count: int) -> None:
        """Raise Refusal(2) unless all of the registers are in the map."""
        if not (address + count <= self._end or (address >= READING and address + count <= MAP_END)):
            raise Refusal(ILLEGAL_ADDRESS)

    def read(self, address: int, count: int) -> bytes:
        """Return `count` registers from `address`; free-running, reading any of 100-119 measures. Raises Refusal."""
        self.check_readable(address, count)
        if address < READING:
            return self._settings()[2 * address : 2 * (address + count)]
        image = self._blank if address >= IDENTITY else self._image(self._device.read())
        return image[2 * (address - READING) : 2 * (address - READING + count)]

    def write(self, address: int, words: bytes) -> None:
        """Write `words` from `address` on, as a whole. Raises Refusal; then nothing has changed."""
        end = address + len(words) // 2
        if end > self._end:
            raise Refusal(ILLEGAL_ADDRESS)
        old = self._settings()
        new = old[: 2 * address] + words + old[2 * end :]
        first, sequence, enable, watchdog_ms, clock, period_us, *further = self._layout.unpack(new)
        levels = (first, *further)
        if not (all(map(isfinite, levels)) and enable <= 1 and clock <= 1 and period_us > 0):
            raise Refusal(ILLEGAL_VALUE)
        device = self._device
        if end > ENABLE:
            if address <= WATCHDOG_MS < end:
                device.set_watchdog(watchdog_ms)
            if end > CLOCK and address < PERIOD_US + 2:
                device.set_clock(lockstep=bool(clock), period_us=period_us)
            if address <= ENABLE:
                device.set_enable(bool(enable))
        self._levels, self._sequence = levels, sequence
        if address <= SEQUENCE < end:
            device.command(levels, sequence)

    def _settings(self) -> bytes:
        d = self._device
        return self._layout.pack(
            self._levels[0],
            self._sequence,
            d.enabled,
            d.watchdog_ms,
            d.lockstep,
            d.period_us,
            *self._levels[1:],
        )

    def _image(self, m: Measurement) -> bytes:
        """Return registers 100-127; those without content are 0."""
        image = bytearray(self._blank)
        for offset, value in zip(self._floats, m.sensed, strict=True):
            _FLOAT32.pack_into(image, offset, value)
        _COUNTER_STATUS_TIME.pack_into(image, 2 * (COUNTER - READING), m.counter, m.status, m.time_us)
        _FLOAT32.pack_into(image, self._reference, m.reference)
        _WORD.pack_into(image, 2 * (SEQUENCE_IN_FORCE - READING), m.sequence)
        return bytes(image)


assert STATUS == COUNTER + 2  # counter, status, time are packed in one go
