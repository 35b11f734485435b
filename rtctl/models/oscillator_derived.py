"""An oscillator in the terms of a vibration engineer: natural frequency, damping ratio, Q, forces as drives.

    f0 = sqrt(k) / 2 pi,  zeta = c / (2 sqrt k),  Q = 1 / (2 zeta)           one rest position, k > 0
    z_w = sqrt(-k / k3),  f_w = sqrt(-2 k) / 2 pi,  F = 2 |k| z_w / (3 sqrt 3)   two wells, k < 0 < k3
    T = 1 / c                                                                a body without a spring

with F the least steady force that leaves no rest position in one of the wells. A force per mass a that is told with a
mechanism is the drive a / g, g the drive's gain; a constant drive u moves the rest position by g u / k.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from rtctl.border.derived import Derived, Estimated, derive
from rtctl.border.mechanisms import plain_unit
from rtctl.border.model_file import ModelFile, Value
from rtctl.border.quantities import convert

Estimates = Mapping[str, Mapping[str, Estimated]]
"""Estimates by mechanism ("": the nominal model) and name."""
REST = ("drive.offset", "offset")
"""Mechanism and parameter of a constant drive."""


def derive_oscillator(estimates: Estimates, units: Mapping[str, str]) -> tuple[Derived, ...]:
    """Return what follows from fitted parameters.

    Args:
        estimates: The nominal parameters damping, stiffness, stiffness_cubic, drive_gain, and those of mechanisms.
        units: Unit of each signal of the data.
    """
    nominal = estimates.get("", {})
    return (*_of_the_motion(nominal, units), *_of_forces(estimates, units))


def derive_from_file(model: ModelFile, units: Mapping[str, str]) -> tuple[Derived, ...]:
    """Return what follows from the parameters of a model file, whose intervals are 95 % ones."""
    tables = {"": model.model.parameters} | {one.id: one.parameters for one in model.model.mechanisms}
    estimates = {
        mechanism: {name: _estimated(value) for name, value in values.items()}
        for mechanism, values in tables.items()
    }
    return derive_oscillator(estimates, units)


def _estimated(value: Value) -> Derived:
    low = value.value if value.low is None else value.low
    high = value.value if value.high is None else value.high
    return Derived("", value.value, low, high, value.unit)


def _of_the_motion(nominal: Mapping[str, Estimated], units: Mapping[str, str]) -> list[Derived]:
    stiffness, damping, gain = (nominal.get(name) for name in ("stiffness", "damping", "drive_gain"))
    cubic = nominal.get("stiffness_cubic")
    z = units.get("displacement", "")
    if stiffness is not None and stiffness.value > 0.0:
        found = [
            *derive("natural frequency", "Hz", lambda k: math.sqrt(k) / (2.0 * math.pi), stiffness),
            *_of_damping("", damping, stiffness, 1.0),
        ]
        if z and "drive" in units and gain is not None:
            per_drive = plain_unit(f"{z}/({units['drive']})")
            of = _in(f"({gain.unit})/({stiffness.unit})", per_drive, lambda g, k: g / k)
            found += derive("static deflection per drive", per_drive, of, gain, stiffness)
        return found
    if stiffness is not None and cubic is not None and stiffness.value < 0.0 < cubic.value:
        return _of_two_wells(stiffness, cubic, damping, gain, units)
    if stiffness is None or stiffness.value == 0.0:
        return derive("time constant of the speed", "s", lambda c: 1.0 / c, damping)
    return []


def _of_damping(where: str, damping: Estimated | None, stiffness: Estimated, sharper: float) -> list[Derived]:
    """Return damping ratio and Q of small motions of rate sqrt(sharper |k|)."""
    if damping is None or not damping.value > 0.0:
        return []
    return [
        *derive(f"damping ratio{where}", "%", lambda c, k: 50.0 * c / math.sqrt(sharper * abs(k)), damping, stiffness),
        *derive(f"quality factor Q{where}", "1", lambda c, k: math.sqrt(sharper * abs(k)) / c, damping, stiffness),
    ]  # fmt: skip


def _of_two_wells(
    stiffness: Estimated, cubic: Estimated, damping: Estimated | None, gain: Estimated | None, units: Mapping[str, str]
) -> list[Derived]:  # fmt: skip
    """Return place, frequency and depth of the wells."""
    z = units.get("displacement", "")
    place = f"(({stiffness.unit})/({cubic.unit}))**0.5"
    found: list[Derived] = []
    if z:
        of = _in(place, z, lambda k, k3: math.sqrt(-k / k3))
        found += derive("wells at plus and minus", z, of, stiffness, cubic)
    found += derive(
        "natural frequency in a well", "Hz", lambda k: math.sqrt(-2.0 * k) / (2.0 * math.pi), stiffness
    )
    found += _of_damping(" in a well", damping, stiffness, 2.0)
    if gain is not None and "drive" in units:
        of = _in(f"({stiffness.unit})*{place}/({gain.unit})", units["drive"],
                 lambda k, k3, g: 2.0 * -k * math.sqrt(-k / k3) / (3.0 * math.sqrt(3.0) * g))  # fmt: skip
        found += derive("steady drive that leaves a well", units["drive"], of, stiffness, cubic, gain)
    return found


def _of_forces(estimates: Estimates, units: Mapping[str, str]) -> list[Derived]:
    """Return every force per mass of a mechanism as a drive, and a constant drive as a displacement."""
    nominal, drive = estimates.get("", {}), units.get("drive", "")
    gain, stiffness = nominal.get("drive_gain"), nominal.get("stiffness")
    found: list[Derived] = []
    for mechanism, parameters in estimates.items():
        for name, one in parameters.items():
            if mechanism and drive and gain is not None and _is_force(one.unit):
                of = _in(f"({one.unit})/({gain.unit})", drive, lambda a, g: a / abs(g))
                found += derive(f"{mechanism}, {name} as a drive", drive, of, one, gain)
    offset = estimates.get(REST[0], {}).get(REST[1])
    z = units.get("displacement", "")
    if z and offset is not None and gain is not None and stiffness is not None and stiffness.value > 0.0:
        unit = f"({gain.unit})*({offset.unit})/({stiffness.unit})"
        of = _in(unit, z, lambda g, u, k: g * u / k)
        found += derive("rest position moved by drive.offset", z, of, gain, offset, stiffness)
    return found


def _is_force(unit: str) -> bool:
    """Return whether `unit` is that of a force per mass: of a length or an angle over a time squared."""
    bare = plain_unit(unit).replace(" ", "")
    return bare.endswith(("/s^2", "/s**2")) and not bare.startswith(("1/", "("))


def _in(unit: str, to: str, of: Callable[..., float]) -> Callable[..., float]:
    """Return `of`, whose results are in `unit`, with results in `to`."""
    factor = convert(1.0, unit, to)
    return lambda *values: factor * of(*values)
