"""Plausibility of a single reading: finite, in range, new, and from a healthy device."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtctl.border.errors import Fault
from rtctl.border.kernels import kernel
from rtctl.border.records import DeviceStatus, Measurement

UINT32 = 0xFFFFFFFF
HALF_UINT32 = 0x80000000
"""Counters and times of a device wrap at 2^32: a difference below half of that goes forward."""
_ENABLED = int(DeviceStatus.ENABLED)
_JUDGED = int(
    DeviceStatus.ENABLED | DeviceStatus.WATCHDOG_TRIPPED | DeviceStatus.SENSOR_FAULT | DeviceStatus.REFUSED
)  # not CLAMPED, which is recorded and is no fault

Finding = tuple[Fault, str]
"""The name of a fault and the sentence that explains it."""


@kernel
def is_plausible(sensed: float, low: float, high: float, status: int, counts: int) -> bool:
    """Return whether a reading is in range and new, and its device healthy.

    Args:
        sensed: the reading of one channel [its unit]; NaN is not plausible.
        low: lower end of the plausible range [its unit].
        high: upper end of the plausible range [its unit].
        status: the device's status bits.
        counts: how far the sample counter advanced since the reading before, modulo 2^32.
    """
    return status & _JUDGED == _ENABLED and low <= sensed <= high and 0 < counts < HALF_UINT32


@dataclass(frozen=True, slots=True, kw_only=True)
class Plausibility:
    """The plausible range of each channel; judges a reading by itself."""

    sensed_low: tuple[float, ...]
    """Lower end of each channel's range [its unit]."""
    sensed_high: tuple[float, ...]
    """Upper end of each channel's range [its unit]."""
    names: tuple[str, ...]
    """Channel names with units, for messages: `"resistance [ohm]"`."""

    def judge(self, new: Measurement, previous: Measurement) -> Finding | None:
        """Return the fault of a reading and its explanation, or None."""
        status, counts = new.status, (new.counter - previous.counter) & UINT32
        for value, low, high in zip(new.sensed, self.sensed_low, self.sensed_high, strict=True):
            if not is_plausible(value, low, high, status, counts):
                return self._explain(new, previous)
        return None

    def _explain(self, new: Measurement, previous: Measurement) -> Finding:
        """Return what is wrong with an implausible reading."""
        if (status_fault := _status_fault(new.status)) is not None:
            return status_fault
        for name, value, low, high in zip(
            self.names, new.sensed, self.sensed_low, self.sensed_high, strict=True
        ):
            if not math.isfinite(value):
                return Fault.NOT_FINITE, f"{name} read {value}, which is not a number to control on"
            if not low <= value <= high:
                return (
                    Fault.OUT_OF_RANGE,
                    f"{name} read {value:.6g}, outside the plausible {low:.6g} to {high:.6g}",
                )
        return (
            Fault.FROZEN_COUNTER,
            f"the sample counter went from {previous.counter} to {new.counter}: no new measurement, or the device "
            "has restarted",
        )


def _status_fault(status: int) -> Finding | None:
    if status & DeviceStatus.WATCHDOG_TRIPPED:
        return Fault.WATCHDOG_TRIPPED, "the device's watchdog tripped; write enable 0, then 1, to re-arm"
    if status & DeviceStatus.SENSOR_FAULT:
        return Fault.SENSOR_FAULT, "the device reports a sensor fault (status bit 3)"
    if status & DeviceStatus.REFUSED:
        return Fault.COMMAND_REFUSED, "the device refused the command (status bit 4)"
    if not status & DeviceStatus.ENABLED:
        return Fault.NOT_ENABLED, "the device is no longer enabled (status bit 0)"
    return None
