"""The file of an ME resonator: every number with its unit, all findings of a bad file in one message."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from plant_sim.bounds import FINITE, NOT_NEGATIVE, POSITIVE
from rtctl.border.units.quantities import Checked, Quantity, check, read_toml


class Nameplate(Checked):
    """The `[plant]` table."""

    kind: Literal["me"]
    name: Annotated[str, Field(pattern=r"^[\x20-\x7e]{1,16}$")]
    """Identity on the wire: printable ASCII, at most 16 characters."""
    seed: Annotated[int, Field(ge=0)]
    """Seed of the instruments' noise."""


class CoilDriver(Checked):
    """Limits of a coil driver."""

    current_high: Annotated[float, Quantity("mA"), POSITIVE]
    """Largest commanded amplitude; the device clamps."""
    frequency_low: Annotated[float, Quantity("Hz"), POSITIVE]
    frequency_high: Annotated[float, Quantity("Hz"), POSITIVE]
    frequency_rest: Annotated[float, Quantity("Hz"), POSITIVE]
    """Frequency before the first command, and when the watchdog trips (the current is 0 then)."""

    @model_validator(mode="after")
    def _ordered(self) -> CoilDriver:
        if not self.frequency_low <= self.frequency_rest <= self.frequency_high:
            raise ValueError(
                f"frequency_rest ({self.frequency_rest} Hz) must lie in [{self.frequency_low}, "
                f"{self.frequency_high}] Hz"
            )
        return self


class Coil(CoilDriver):
    """The `[coil]` table; the voltage that the driver sets is R i_cmd."""

    resistance: Annotated[float, Quantity("ohm"), POSITIVE]
    inductance: Annotated[float, Quantity("H"), POSITIVE]
    field: Annotated[float, Quantity("T/A"), POSITIVE]
    """Flux density per current."""


class Magnetisation(Checked):
    """The `[magnetisation]` table of the magnetostrictive film."""

    saturation: Annotated[float, Quantity("A/m"), POSITIVE]
    susceptibility: Annotated[float, POSITIVE]
    """Initial susceptibility."""


class Beam(Checked):
    """The `[beam]` table: the first bending mode."""

    frequency: Annotated[float, Quantity("Hz"), POSITIVE]
    quality: Annotated[float, Field(gt=1.0, allow_inf_nan=False)]
    stiffness_cubic: Annotated[float, Quantity("1/(um^2*s^2)"), FINITE]
    stiffness_quintic: Annotated[float, Quantity("1/(um^4*s^2)"), FINITE] = 0.0
    drive: Annotated[float, Quantity("um/s^2/(A/m)"), POSITIVE]
    """Modal acceleration per magnetisation."""
    broken_above: Annotated[float, Quantity("um"), POSITIVE]
    """Largest displacement of the model; beyond, the sensor reports a fault."""


class LockIn(Checked):
    """The `[lock_in]` table."""

    reference: Literal["current", "command"] = "current"
    """Reference of phase 0: the coil's measured current, or the command, which leads it."""
    white: Annotated[float, Quantity("um/Hz^0.5"), NOT_NEGATIVE]
    """Noise of the displacement sensor: square root of its one-sided density."""
    converter_range: Annotated[float, Quantity("um"), POSITIVE]
    """Outputs lie between minus this and plus this, and stay at the end beyond."""
    converter_bits: Annotated[int, Field(ge=0, le=24)]
    """Bits of the converter; 0: no rounding."""
    vibrometer: Annotated[float, Quantity("um/Hz^0.5"), NOT_NEGATIVE]
    """Noise of the reference instrument, likewise."""


class MeDeviceFile(Checked):
    """The whole file."""

    plant: Nameplate
    coil: Coil
    magnetisation: Magnetisation
    beam: Beam
    lock_in: LockIn

    @model_validator(mode="after")
    def _fine_enough(self) -> MeDeviceFile:
        least, most = 0.8 * self.beam.frequency, 1.25 * self.beam.frequency
        if not (self.coil.frequency_low >= least and self.coil.frequency_high <= most):
            raise ValueError(
                f"coil.frequency_low ({self.coil.frequency_low} Hz) and coil.frequency_high "
                f"({self.coil.frequency_high} Hz) must lie in [{least:.6g}, {most:.6g}] Hz: the integration's step "
                "is a part of the drive's period and has to suit the beam"
            )
        return self


def read_me_device(path: Path) -> MeDeviceFile:
    """Read the device in the file. Raises InputError with file and key."""
    return check(MeDeviceFile, read_toml(path), str(path))
