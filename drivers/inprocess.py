"""Driver of a device in this process: the same exchange as over a wire, without the wire."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import Device, DeviceStatus, Measurement, SwitchedOff
from rtctl.border.wire.wire_memory import SEQUENCE, CompiledExchange

_REFUSED = int(DeviceStatus.REFUSED)


class InProcessDriver:
    """A driver (`rtctl.border.records.Driver`) around a `Device`."""

    def __init__(self, device: Device) -> None:
        self.profile = device.profile
        self.identity = device.identity
        self._device = device
        self._sequence = 0

    def open(self, *, lockstep_period_us: int | None, watchdog_ms: int, timeout_s: float) -> Measurement:
        """Set clock [us] and watchdog [ms], re-arm, read once. Nothing here can take `timeout_s` [s].

        Raises DriverError.
        """
        device = self._device
        try:
            device.set_enable(False)
            device.set_clock(lockstep=lockstep_period_us is not None, period_us=lockstep_period_us or 0)
            device.set_watchdog(watchdog_ms)
            device.set_enable(True)
        except ValueError as error:
            raise DriverError(Fault.COMMAND_REFUSED, f"device {self.identity}: {error}") from None
        first = device.read()
        self._sequence = first.sequence
        return first

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Command `levels` (profile's units) and read. Raises DriverError."""
        self._sequence = sequence = (self._sequence + 1) & 0xFFFF
        try:
            measurement = self._device.exchange(levels, sequence)
        except ValueError as error:
            raise DriverError(Fault.COMMAND_REFUSED, f"device {self.identity}: {error}") from None
        if measurement.sequence != sequence and not measurement.status & _REFUSED:
            raise DriverError(
                Fault.STALE_REPLY,
                f"device {self.identity}: command {measurement.sequence} is in force, sent was {sequence}",
            )
        return measurement

    def compiled_exchange(self) -> CompiledExchange | None:
        """Return the exchange for a compiled loop; None if the device has none."""
        find = getattr(self._device, "compiled_exchange", None)
        if find is None or type(self).exchange is not _EXCHANGE:  # a derived driver watches every exchange
            return None
        device: CompiledExchange | None = find()
        if device is None:
            return None
        line = device.memory.line

        def lend() -> None:
            line[SEQUENCE] = self._sequence
            device.lend()

        def give_back() -> None:
            self._sequence = int(line[SEQUENCE])
            device.give_back()

        return device._replace(lend=lend, give_back=give_back)

    def close(self, safe_levels: Sequence[float]) -> SwitchedOff:
        """Command `safe_levels`, disable. Never raises."""
        with suppress(DriverError):
            self.exchange(safe_levels)
        with suppress(ValueError):
            self._device.set_enable(False)
            return SwitchedOff.OFF
        return SwitchedOff.SILENT


_EXCHANGE = InProcessDriver.exchange
