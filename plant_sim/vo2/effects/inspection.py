"""What a VO2 device really does, and its effects by name (`effects.delay`), switched while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from plant_sim.vo2.effects.table import Effects
from rtctl.border.units.quantities import check

PREFIX = "effects."
TRUTHS = (
    ("true_deflection", "um"), ("true_resistance", "ohm"), ("temperature", "degC"), ("acting_current", "mA"),
    ("electrical_fraction", ""), ("structural_fraction", ""),
)  # fmt: skip
"""Names and units of what a device really does: without its instruments."""
UNITS = {
    "second_share": "", "second_time_constant": "s", "tcr": "1/K", "phase_heating": "", "loss": "1/K", "sensing": "K",
    "warming": "K/s", "delay": "s", "gain_drift": "1/s", "backlash": "mA", "domain_lag": "s", "swing_share": "",
    "swing_frequency": "Hz", "swing_damping": "", "sensor_lag": "s", "ageing": "1/s", "leak": "ohm/mA", "gain_loss": "",
    "noise_growth": "",
}  # fmt: skip
"""Units of the effects, as their table has them."""


class Inspected(Protocol):
    """What is looked at of a device (`plant_sim.vo2.plant.Vo2Plant`)."""

    effects: Effects

    def set_effects(self, effects: Effects) -> None:
        """Put other effects in force."""
        ...

    def truth(self) -> tuple[float, ...]:
        """Return what the device does, in the order of `TRUTHS`."""
        ...


class Vo2Inspection:
    """A look into a device; it follows the kernels with effects from then on, which are slower."""

    truths: Sequence[tuple[str, str]] = TRUTHS

    def __init__(self, plant: Inspected) -> None:
        self._plant = plant
        self.switches: Mapping[str, str] = {PREFIX + name: unit for name, unit in UNITS.items()}

    def truth(self) -> tuple[float, ...]:
        """Return deflection, resistance, temperature, the current that heats, and the transition's two fractions."""
        return self._plant.truth()

    def values(self) -> dict[str, float]:
        """Return the effects."""
        return {PREFIX + name: value for name, value in self._plant.effects}

    def check(self, name: str, value: float) -> None:
        """Raise InputError where an effect cannot have this value."""
        self._with(name, value)

    def switch(self, name: str, value: float) -> None:
        """Give an effect another size; a drift begins when it is switched on."""
        self._plant.set_effects(self._with(name, value))

    def _with(self, name: str, value: float) -> Effects:
        numbers = {**dict(self._plant.effects), name.removeprefix(PREFIX): value}
        tables = {one: {"value": number, "unit": UNITS[one]} for one, number in numbers.items()}
        return check(Effects, tables, "effects")
