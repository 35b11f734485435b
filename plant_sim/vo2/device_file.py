"""The file of a VO2 device: every number with its unit, all findings of a bad file in one message."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from plant_sim.bounds import NOT_NEGATIVE
from plant_sim.sensing import Sensing
from plant_sim.vo2.deflection import Deflection
from plant_sim.vo2.domains import Domains
from plant_sim.vo2.effects.changes import Change, ordered
from plant_sim.vo2.effects.table import Effects
from plant_sim.vo2.heating import Heating
from plant_sim.vo2.limiting_loop import LimitingLoop
from plant_sim.vo2.resistance import Resistance, semiconductor_at
from rtctl.border.units.quantities import Checked, Quantity, check, read_toml


class Nameplate(Checked):
    """The `[plant]` table."""

    kind: Literal["vo2"]
    name: Annotated[str, Field(pattern=r"^[\x20-\x7e]{1,16}$")]
    """Identity on the wire: printable ASCII, at most 16 characters."""
    seed: Annotated[int, Field(ge=0)]
    """Seed of the instruments' noise (the film's own draw has its seed in `[hysteresis]`)."""


class Current(Checked):
    """The `[current]` table: the device's own limits of the heater current."""

    low: Annotated[float, Quantity("mA"), NOT_NEGATIVE]
    high: Annotated[float, Quantity("mA"), NOT_NEGATIVE]
    safe: Annotated[float, Quantity("mA"), NOT_NEGATIVE]
    """Current when its watchdog trips."""

    @model_validator(mode="after")
    def _ordered(self) -> Current:
        if not self.low < self.high:
            raise ValueError(f"low ({self.low} mA) must be < high ({self.high} mA)")
        if not self.low <= self.safe <= self.high:
            raise ValueError(f"safe ({self.safe} mA) must lie in [{self.low}, {self.high}] mA")
        return self


class DeviceFile(Checked):
    """The whole file."""

    plant: Nameplate
    current: Current
    heating: Heating
    hysteresis: Annotated[Domains | LimitingLoop, Field(discriminator="kind")]
    resistance: Resistance
    deflection: Deflection
    sensing: Sensing
    effects: Effects = Effects()
    changes: tuple[Change, ...] = ()
    """Effects that the device takes on or loses while it runs, `[[changes]]`."""

    @model_validator(mode="after")
    def _changes_in_order(self) -> DeviceFile:
        ordered(self.effects, self.changes)
        return self

    @model_validator(mode="after")
    def _converter_reaches(self) -> DeviceFile:
        film, sensing = self.resistance, self.sensing
        coldest_ohm = film.metal + semiconductor_at(film.prefactor, film.activation, self.heating.ambient)
        voltage = 1e-3 * sensing.current * coldest_ohm
        if not voltage < sensing.converter_range:
            raise ValueError(
                f"sensing.converter_range ({sensing.converter_range} V) must exceed the {voltage:.3g} V that "
                f"sensing.current ({sensing.current} mA) drops across the cold film's {coldest_ohm:.4g} ohm"
            )
        return self


def read_device(path: Path) -> DeviceFile:
    """Read the device in the file. Raises InputError with file and key."""
    return check(DeviceFile, read_toml(path), str(path))
