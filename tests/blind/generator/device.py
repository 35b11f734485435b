"""The device of a case: dimensionless truth, and the scales that give it units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .equation import N_PARAMETERS, P
from .options import Options
from .plan import Plan
from .truth import Quantity

SHAPES = ("none", "hardening", "softening", "bistable")
METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
RADIANS = {"rad": 1.0, "deg": np.pi / 180.0}


@dataclass(frozen=True, kw_only=True)
class Device:
    """What was drawn; `length` in the displacement's unit, `drive` in the drive's unit, for a dimensionless 1."""

    f0_Hz: float
    quality: float
    shape: str
    stiffness: float
    stiffness_cubic: float
    well: float
    samples_a_period: float
    manifest_hold: str
    displacement_unit: str
    drive_unit: str
    length: float

    @property
    def radian(self) -> float:
        """One radian, dimensionless; NaN where the displacement is no angle."""
        if self.displacement_unit not in RADIANS:
            return float("nan")
        return 1.0 / (RADIANS[self.displacement_unit] * self.length)

    @property
    def omega0(self) -> float:
        """rad/s, of small motion about rest."""
        return 2 * np.pi * self.f0_Hz

    def plan(self) -> Plan:
        """The device without effects, drive gain 1."""
        parameters = np.zeros(N_PARAMETERS)
        parameters[P.C] = 1.0 / self.quality
        parameters[P.K] = self.stiffness
        parameters[P.K3] = self.stiffness_cubic
        parameters[P.G] = 1.0
        return Plan(
            parameters=parameters,
            hold=self.manifest_hold,
            samples_a_period=self.samples_a_period,
            rest=self.well,
        )

    def quantity(self, value: float, length: int, time: int, drive: int, drive_scale: float) -> Quantity:
        """A dimensionless value with its unit; the powers say of what."""
        scaled = value * self.length**length * self.omega0 ** (-time) * drive_scale**drive
        above = [_power(n, d) for n, d in self._units(length, time, drive) if d > 0]
        below = [_power(n, -d) for n, d in self._units(length, time, drive) if d < 0]
        unit = "*".join(above) or "1"
        if below:
            unit += f"/{below[0]}" if len(below) == 1 else f"/({'*'.join(below)})"
        return Quantity(value=float(scaled), unit=unit)

    def _units(self, length: int, time: int, drive: int) -> list[tuple[str, int]]:
        drive_unit = f"({self.drive_unit})" if "/" in self.drive_unit else self.drive_unit
        return [(self.displacement_unit, length), ("s", time), (drive_unit, drive)]


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"


def draw_device(rng: np.random.Generator, options: Options, ids: tuple[str, ...]) -> Device:
    """A device on which the effects `ids` can act."""
    shape = options.shape or str(rng.choice(SHAPES, p=[0.35, 0.35, 0.18, 0.12]))
    if "stiffness.cubic" in ids:
        shape = "none"  # a cubic term of the nominal model is a parameter, not a mechanism
    elif {"drive.offset", "sensor.offset"} & set(ids) and shape == "none" and options.shape is None:
        shape = "none" if rng.random() < 0.2 else "hardening"  # on a linear device the two are one
    spp = options.samples_a_period or float(rng.uniform(15.0, 40.0 if "input.hold" in ids else 60.0))
    low, high = (8.0, 4000.0) if "sensor.hum" in ids else (2.0, 10_000.0)
    low = max(low, 210.0 / spp) if "sensor.hum" in ids else low
    f0 = options.f0_Hz or float(np.exp(rng.uniform(np.log(low), np.log(high))))
    well, stiffness, cubic = 0.0, 1.0, 0.0
    if shape == "hardening":
        cubic = float(np.exp(rng.uniform(np.log(0.01), np.log(0.08))))
    elif shape == "softening":
        cubic = -float(np.exp(rng.uniform(np.log(0.008), np.log(0.03))))
    elif shape == "bistable":  # omega0 of small motion in a well: -2 stiffness = 1
        well = float(rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 9.0))
        stiffness, cubic = -0.5, 0.5 / well**2
    drive_unit = str(rng.choice(["V", "N", "m/s^2", "mT"] if f0 < 1000.0 else ["V", "N", "mT"]))
    metres = float(
        np.exp(rng.uniform(np.log(2e-5), np.log(5e-3)) if f0 < 100.0 else rng.uniform(-17.0, -10.0))
    )
    unit = "m" if rng.random() < 0.12 else ("mm" if metres > 1e-4 else "um")
    if options.angle or "stiffness.gravity" in ids:
        unit, drive_unit = str(rng.choice(list(RADIANS))), "V"
        metres = float(rng.uniform(0.35, 0.9))
    return Device(
        f0_Hz=f0,
        quality=options.quality or float(np.exp(rng.uniform(np.log(5.0), np.log(500.0)))),
        shape=shape,
        stiffness=stiffness,
        stiffness_cubic=cubic,
        well=well,
        samples_a_period=spp,
        manifest_hold=options.hold
        or str(rng.choice(["linear", "zero", "band-limited"], p=[0.45, 0.35, 0.2])),
        displacement_unit=unit,
        drive_unit=drive_unit,
        length=metres / (METRES | RADIANS)[unit],
    )


def draw_drive_scale(rng: np.random.Generator, device: Device, gain: float) -> float:
    """Drive, in its unit, of a dimensionless 1; a shaken device feels the shaker's acceleration, times about 1."""
    if device.drive_unit == "m/s^2":
        acceleration = gain * device.omega0**2 * device.length * METRES[device.displacement_unit]
        return float(acceleration / rng.uniform(0.8, 1.6))
    return float(np.exp(rng.uniform(np.log(0.05), np.log(20.0))))
