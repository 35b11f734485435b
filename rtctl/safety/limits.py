"""What may reach the device and what may be believed of it; it trusts neither controller nor wire."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceStatus, Measurement

_UINT32, _HALF = 0xFFFFFFFF, 0x80000000
_HEALTHY = int(DeviceStatus.ENABLED)  # a plain int: to compare with an enum costs a tenth of a microsecond


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLimits:
    """Bounds of one command channel, in its unit."""

    low: float
    high: float
    safe: float
    slew_per_s: float = math.inf
    rms: float = math.inf
    """Largest root mean square of the command over `rms_window_s` (`rtctl.safety.guards.EnergyGuard`)."""
    rms_window_s: float = 1.0
    stop: bool = False
    """What is asked beyond bounds or slew ends the run instead of being held back."""

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"limits: low = {self.low:g} must be below high = {self.high:g}")
        if not min(0.0, self.low) <= self.safe <= self.high:
            raise ValueError(
                f"limits: safe = {self.safe:g} must lie between {min(0.0, self.low):g} and high = {self.high:g}"
            )
        if not self.slew_per_s > 0.0:
            raise ValueError(f"limits: slew = {self.slew_per_s:g} a second must be > 0")
        if not self.rms > abs(self.safe):
            raise ValueError(
                f"limits: rms = {self.rms:g} must exceed safe = {self.safe:g}, which is held for long"
            )
        if not self.rms_window_s > 0.0:
            raise ValueError(f"limits: rms_window = {self.rms_window_s:g} s must be > 0 s")

    def clip(self, level: float, previous: float, elapsed_s: float) -> float:
        """`level` within bounds and slew; the bounds come first.

        Raises DriverError on one that is not finite, and where `stop` is set on any that would have to be changed.
        """
        if not math.isfinite(level):
            raise DriverError(
                Fault.NOT_FINITE,
                f"the controller asked for {level}, which is no level to command; is the model sound?",
            )
        reach = self.slew_per_s * elapsed_s
        if self.stop:
            self._refuse(level, previous, reach)
        if level > previous + reach:  # comparisons: min and max cost three times as much, every step
            level = previous + reach
        elif level < previous - reach:
            level = previous - reach
        if level < self.low:
            return self.low
        return self.high if level > self.high else level

    def _refuse(self, level: float, previous: float, reach: float) -> None:
        if not self.low <= level <= self.high:
            raise DriverError(
                Fault.LEVEL_LIMIT,
                f"the controller asked for {level:.6g}, outside {self.low:g} to {self.high:g}, and limits.stop is set",
            )
        if abs(level - previous) > reach and self.low <= previous <= self.high:
            raise DriverError(
                Fault.SLEW_LIMIT,
                f"the controller asked for a step from {previous:.6g} to {level:.6g}, more than the {reach:.4g} that "
                "limits.slew allows at once, and limits.stop is set",
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Plausibility:
    """What a believable reading looks like: finite, in range, fresh, from a healthy device."""

    sensed_low: tuple[float, ...]
    sensed_high: tuple[float, ...]
    names: tuple[str, ...]
    """Channel names with units, for messages: `"resistance [ohm]"`."""

    def judge(self, new: Measurement, previous: Measurement) -> tuple[Fault, str] | None:
        """The fault of a reading and its sentence, or None."""
        status = new.status
        if status != _HEALTHY and (found := _status_fault(status)):
            return found
        for value, low, high in zip(new.sensed, self.sensed_low, self.sensed_high, strict=True):
            if not low <= value <= high:
                return self._implausible(new.sensed)
        if not 0 < (new.counter - previous.counter) & _UINT32 < _HALF:  # it wraps at 2^32
            return (
                Fault.FROZEN_COUNTER,
                f"the sample counter went from {previous.counter} to {new.counter}: no new measurement, or a device "
                "that has restarted",
            )
        return None

    def _implausible(self, sensed: tuple[float, ...]) -> tuple[Fault, str] | None:
        for name, value, low, high in zip(self.names, sensed, self.sensed_low, self.sensed_high, strict=True):
            if not math.isfinite(value):
                return Fault.NOT_FINITE, f"{name} read {value}, which is not a number to control on"
            if not low <= value <= high:
                return (
                    Fault.OUT_OF_RANGE,
                    f"{name} read {value:.6g}, outside the plausible {low:.6g} to {high:.6g}",
                )
        return None


def _status_fault(status: int) -> tuple[Fault, str] | None:
    if status & DeviceStatus.WATCHDOG_TRIPPED:
        return Fault.WATCHDOG_TRIPPED, "the device's watchdog tripped; write enable 0, then 1, to re-arm"
    if status & DeviceStatus.SENSOR_FAULT:
        return Fault.SENSOR_FAULT, "the device reports a sensor fault (status bit 3)"
    if status & DeviceStatus.REFUSED:
        return Fault.COMMAND_REFUSED, "the device refused the command (status bit 4)"
    if not status & DeviceStatus.ENABLED:
        return Fault.NOT_ENABLED, "the device is no longer enabled (status bit 0)"
    return None  # clamped: recorded, not a fault
