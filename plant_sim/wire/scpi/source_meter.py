"""A current source with a compliance voltage, and a voltmeter, at the two ends of a device's resistance.

What flows is the commanded current, or what the compliance voltage V_c drives through the resistance R, if that is
less: I = min(level, V_c / R). V = R I is read over an aperture of NPLC power line cycles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from plant_sim.device import SimulatedDevice
from rtctl.border.errors import InputError
from rtctl.border.units.quantities import convert

INFINITE, NO_NUMBER = 9.9e37, 9.91e37
"""Values of SCPI-99 for a reading beyond its range, and for none."""
LINE_HZ = 50.0
OVERHEAD_S = 1e-3
"""Of a reading besides its aperture: as of a source meter without automatic ranging."""
OVERRANGE = 1.05
LARGEST_CURRENT_A, LARGEST_VOLTAGE_V = 1.05, 210.0
TINY = 1e-30
"""Stands for a resistance of 0 [ohm] where it divides."""
OUT_OF_RANGE = (-222, "Parameter data out of range")


class RefusedError(Exception):
    """A command that is not carried out: an entry of the error queue."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code, self.text = code, text


class Measured(NamedTuple):
    """One reading."""

    voltage_V: float
    current_A: float
    limited: bool
    """Whether the compliance voltage limits the current."""
    overflow: bool
    """Whether the voltage is beyond the range of the voltmeter."""


@dataclass(slots=True)
class Settings:
    """What a reset sets."""

    level_A: float = 0.0
    current_range_A: float | None = None
    """None: automatic."""
    compliance_V: float = 21.0
    voltage_range_V: float | None = None
    nplc: float = 1.0


class SourceMeter:
    """The analogue part of every simulated source meter."""

    def __init__(self, device: SimulatedDevice) -> None:
        """Take the two ends of `device`. Raises InputError where it is no resistance that a current drives."""
        command, reading = device.profile.commands[0], device.profile.sensed[0]
        try:
            self._per_ampere = convert(1.0, "A", command.unit)
            self._ohm = convert(1.0, reading.unit, "ohm")
        except ValueError:
            raise InputError(
                f"{device.identity}: a source meter drives a current and reads a resistance, this device takes "
                f"{command.name} in {command.unit} and reads {reading.name} in {reading.unit}"
            ) from None
        self._device = device
        self._sequence = 0
        self.settings = Settings()
        self._driven_A: float | None = None
        self.reset()

    @property
    def is_on(self) -> bool:
        """Whether the output is on."""
        return self._device.enabled

    @property
    def aperture_s(self) -> float:
        """How long a reading takes."""
        return self.settings.nplc / LINE_HZ + OVERHEAD_S

    def reset(self) -> None:
        """Switch off and forget all settings."""
        self.switch(False)
        self.settings = Settings()

    def switch(self, on: bool) -> None:
        """Switch the output."""
        self._device.set_enable(on)
        self._driven_A = None
        if on:
            self._flow()

    def set_level(self, amperes: float) -> None:
        """Command a current. Raises RefusedError beyond the range."""
        most = (
            LARGEST_CURRENT_A
            if self.settings.current_range_A is None
            else OVERRANGE * self.settings.current_range_A
        )
        if not abs(amperes) <= most:
            raise RefusedError(*OUT_OF_RANGE)
        self.settings.level_A = amperes
        if self.is_on:
            self._flow()

    def measure(self) -> Measured:
        """Return a reading. Raises RefusedError while the output is off."""
        if not self.is_on:
            raise RefusedError(803, "Not permitted with OUTPUT off")
        settings = self.settings
        resistance_ohm, current_A = self._flow()
        voltage_V = current_A * resistance_ohm
        overflow = (
            settings.voltage_range_V is not None and abs(voltage_V) > OVERRANGE * settings.voltage_range_V
        )
        if not math.isfinite(voltage_V):
            voltage_V = NO_NUMBER
        elif overflow:
            voltage_V = math.copysign(INFINITE, voltage_V)
        return Measured(voltage_V, current_A, current_A != settings.level_A, overflow)

    def _flow(self) -> tuple[float, float]:
        """Drive what the level and the compliance voltage allow; return the resistance [ohm] and the current [A]."""
        resistance_ohm = self._device.read().sensed[0] * self._ohm
        current_A, most_A = self.settings.level_A, self.settings.compliance_V / max(resistance_ohm, TINY)
        if abs(current_A) > most_A:
            current_A = math.copysign(most_A, current_A)
        if current_A != self._driven_A:
            self._driven_A = current_A
            self._sequence = (self._sequence + 1) & 0xFFFF
            level = current_A * self._per_ampere
            self._device.command((level, *self._device.off[1:]), self._sequence)
        return resistance_ohm, current_A


def in_range(low: float, value: float, high: float) -> float:
    """Return `value`. Raises RefusedError outside of the bounds, or for NaN."""
    if not low <= value <= high:
        raise RefusedError(*OUT_OF_RANGE)
    return value
