"""An oscillator in the terms of a vibration engineer: natural frequency, damping ratio, Q, forces as drives.

    f0 = sqrt(k) / 2 pi,  zeta = c / (2 sqrt k),  Q = 1 / (2 zeta)           one rest position, k > 0
    f(z_w) = 0,  f_w = sqrt f'(z_w) / 2 pi,  F = max |f(0 ... z_w)|          in wells, k < 0
    T = 1 / c,  v = g u / c                                                  a body without a spring
    f = sqrt(k + k_s) / 2 pi                                                 at rest on a stop of stiffness k_s
    z_1 = sqrt(k / |k3|),  r = k3 z_max^2 / k                                a spring that hardens or softens, k > 0

with f the restoring force and F the least steady force that leaves no rest position in the well. A force per mass a
that is told with a mechanism is the drive a / g, g the drive's gain; a constant drive u moves the rest position by
g u / k. What needs a spring is told only where the data certainly show one (`spring.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from rtctl.border.mechanisms import plain_unit
from rtctl.border.model_file import ModelFile, Value
from rtctl.border.units.quantities import convert
from rtctl.models.derived.quantity import Derived, Estimated, derive
from rtctl.models.derived.spring import is_certain, is_spring, is_well
from rtctl.models.derived.wells import barrier_of, stiffness_at, well_of
from rtctl.output.readable_units import readable

Estimates = Mapping[str, Mapping[str, Estimated]]
"""Estimates by mechanism ("": the nominal model) and name."""
TERMS = (
    ("", "stiffness", 1), ("stiffness.quadratic", "coefficient", 2), ("", "stiffness_cubic", 3),
    ("stiffness.cubic", "coefficient", 3), ("stiffness.quintic", "coefficient", 5),
)  # fmt: skip
"""Terms of the restoring force: mechanism, parameter, power of the displacement."""
HARDENING, SOFTENING = "hardening spring", "softening spring"
LEAST_CUBIC = 0.01
"""Share of the cubic force in the linear one, at the largest displacement, from which it is told."""
ALTERING = {"stiffness.gravity", "stiffness.clearance", "stiffness.viscoelastic"}
"""Mechanisms with which small motions do not follow from the stiffness alone."""
STOPS = ("stop.one_sided", "stop.two_sided")
REST = ("drive.offset", "offset")
"""Mechanism and parameter of a constant drive."""


def derive_oscillator(
    estimates: Estimates, units: Mapping[str, str], largest: float = 0.0, longest_s: float = 0.0
) -> tuple[Derived, ...]:
    """Return what follows from fitted parameters.

    Args:
        estimates: The nominal parameters damping, stiffness, stiffness_cubic, drive_gain, and those of mechanisms.
        units: Unit of each signal of the data.
        largest: Largest displacement of the data, in its unit; 0: not known.
        longest_s: Duration of the longest record of the data [s]; 0: not known.
    """
    nominal = estimates.get("", {})
    if not is_spring(nominal.get("stiffness"), nominal.get("damping"), longest_s):
        return (*_of_a_free_body(estimates, units), *_of_forces(estimates, units))
    return (
        *_of_the_motion(estimates, units), *_of_cubic_force(estimates, units, largest),
        *_of_forces(estimates, units), *_of_rest(estimates, units),
    )  # fmt: skip


def derive_from_file(
    model: ModelFile, units: Mapping[str, str], largest: float = 0.0, longest_s: float = 0.0
) -> tuple[Derived, ...]:
    """Return what follows from the parameters of a model file, whose intervals are 95 % ones."""
    tables = {"": model.model.parameters} | {one.id: one.parameters for one in model.model.mechanisms}
    estimates = {
        mechanism: {name: _estimated(value) for name, value in values.items()}
        for mechanism, values in tables.items()
    }
    return derive_oscillator(estimates, units, largest, longest_s)


def _estimated(value: Value) -> Derived:
    low = value.value if value.low is None else value.low
    high = value.value if value.high is None else value.high
    return Derived("", value.value, low, high, value.unit)


def _of_a_free_body(estimates: Estimates, units: Mapping[str, str]) -> list[Derived]:
    """Return how fast the speed of a body without a spring follows its drive, and the speed that it reaches."""
    nominal, z = estimates.get("", {}), units.get("displacement", "")
    damping, gain = nominal.get("damping"), nominal.get("drive_gain")
    if damping is None or not damping.value > 0.0 or not is_certain(damping) or ALTERING & set(estimates):
        return []
    rate = convert(1.0, damping.unit, "1/s")
    found = derive("time constant of the speed", "s", lambda c: 1.0 / (rate * c), damping)
    if z and units.get("drive") and gain is not None:
        per_drive = plain_unit(f"{z}/(s*{units['drive']})")
        of = _in(f"({gain.unit})/({damping.unit})", per_drive, lambda g, c: g / c)
        found += derive("steady speed per drive", per_drive, of, gain, damping)
    return found


def _of_the_motion(estimates: Estimates, units: Mapping[str, str]) -> list[Derived]:
    nominal = estimates.get("", {})
    stiffness, damping, gain = (nominal.get(name) for name in ("stiffness", "damping", "drive_gain"))
    z = units.get("displacement", "")
    if ALTERING & set(estimates):
        return []
    if stiffness is None:
        return []
    if set(STOPS) & set(estimates):
        return _beside_stops(estimates, stiffness, damping) if stiffness.value > 0.0 else []
    if stiffness.value < 0.0:
        is_told = is_well(stiffness, damping)
        return (
            _of_wells(estimates, z, units.get("drive", "")) if is_told else _of_a_free_body(estimates, units)
        )
    found = [
        *derive("natural frequency", "Hz", lambda k: math.sqrt(k) / (2.0 * math.pi), stiffness),
        *_of_damping("", damping, math.sqrt, stiffness),
    ]
    if z and "drive" in units and gain is not None:
        per_drive = plain_unit(f"{z}/({units['drive']})")
        of = _in(f"({gain.unit})/({stiffness.unit})", per_drive, lambda g, k: g / k)
        found += derive("static deflection per drive", per_drive, of, gain, stiffness)
    return found


def _beside_stops(estimates: Estimates, stiffness: Estimated, damping: Estimated | None) -> list[Derived]:
    """Return frequency and damping of small motions about the rest without drive, off a stop or on one."""
    pressed = [one for name in STOPS if name in estimates for one in _pressed(estimates[name])]
    if not pressed:
        return [
            *derive("natural frequency off the stop", "Hz", lambda k: math.sqrt(k) / (2.0 * math.pi), stiffness),
            *_of_damping(" off the stop", damping, math.sqrt, stiffness),
        ]  # fmt: skip
    factor = convert(1.0, pressed[0].unit, stiffness.unit)

    def rate(k: float, stop: float) -> float:
        return math.sqrt(k + factor * stop)

    of = (stiffness, pressed[0])
    return derive("natural frequency on the stop", "Hz", lambda *v: rate(*v) / (2.0 * math.pi), *of)


def _pressed(stop: Mapping[str, Estimated]) -> list[Estimated]:
    """Return the stiffness of the stop that a spring without force is pressed into; none where it is free."""
    if "stiffness" in stop:
        free = stop["lower"].value <= 0.0 <= stop["upper"].value
        return [] if free else [stop["stiffness"]]
    side = "above" if stop["place"].value < 0.0 else "below"
    return [stop[side]] if side in stop and stop[side].value > 0.0 else []


def _of_cubic_force(estimates: Estimates, units: Mapping[str, str], largest: float) -> list[Derived]:
    """Return where a cubic force equals the linear one, and its share at the largest displacement.

    Nothing where that share is below `LEAST_CUBIC` somewhere in its interval, or the interval is not known.
    """
    z = units.get("displacement", "")
    stiffness = estimates.get("", {}).get("stiffness")
    cubic = [estimates[where][name] for where, name, power in TERMS
             if power == 3 and name in estimates.get(where, {})]  # fmt: skip
    if not (z and largest > 0.0 and cubic and stiffness is not None and stiffness.value > 0.0):
        return []
    k_factor = convert(1.0, stiffness.unit, "1/s**2")
    factors = [convert(1.0, one.unit, f"1/(({z})**2*s**2)") / k_factor for one in cubic]

    def over_linear(k: float, *terms: float) -> float:
        """Cubic over linear force at a displacement of 1 z."""
        return sum(factor * one for factor, one in zip(factors, terms, strict=True)) / k

    share = derive("cubic over linear force", "1", lambda *v: over_linear(*v) * largest**2, stiffness, *cubic)
    if not share or not share[0].low < share[0].high:
        return []
    least = min(abs(share[0].low), abs(share[0].high)) if share[0].low * share[0].high > 0.0 else 0.0
    if least < LEAST_CUBIC:
        return []
    spring = HARDENING if share[0].value > 0.0 else SOFTENING
    return [
        *derive(f"{spring}: cubic force equals linear force at", z,
                lambda *v: abs(over_linear(*v)) ** -0.5, stiffness, *cubic),
        share[0]._replace(
            name=f"{spring}: at the largest displacement, {readable(largest, z, 3)}, cubic over linear force"
        ),
    ]  # fmt: skip


def _of_damping(
    where: str, damping: Estimated | None, rate: Callable[..., float], *parameters: Estimated
) -> list[Derived]:
    """Return damping ratio and Q of small motions of angular frequency `rate(*parameters)`."""
    if damping is None or not damping.value > 0.0:
        return []
    of = (damping, *parameters)
    return [
        *derive(f"damping ratio{where}", "%", lambda c, *values: 50.0 * c / rate(*values), *of),
        *derive(f"quality factor Q{where}", "1", lambda c, *values: rate(*values) / c, *of),
    ]


def _of_wells(estimates: Estimates, z: str, drive: str) -> list[Derived]:
    """Return place, frequency and depth of the wells in which a bistable oscillator rests."""
    terms = [
        (power, estimates[where][name]) for where, name, power in TERMS if name in estimates.get(where, {})
    ]
    if not z:
        return []
    factors = [convert(1.0, one.unit, f"1/(({z})**{power - 1}*s**2)") for power, one in terms]
    parameters = [one for _, one in terms]

    def force(values: Sequence[float]) -> dict[int, float]:
        found: dict[int, float] = {}
        for (power, _), factor, value in zip(terms, factors, values, strict=True):
            found[power] = found.get(power, 0.0) + factor * value
        return found

    sides = {1.0: " in a well"}
    if any(power % 2 == 0 for power, _ in terms):
        sides = {1.0: " in the upper well", -1.0: " in the lower well"}
    return [
        one
        for side, where in sides.items()
        for one in _of_one_well(estimates.get("", {}), force, parameters, (z, drive), (side, where))
    ]


def _of_one_well(
    nominal: Mapping[str, Estimated],
    force: Callable[[Sequence[float]], dict[int, float]],
    parameters: Sequence[Estimated],
    units: tuple[str, str],
    where: tuple[float, str],
) -> list[Derived]:
    """Return the figures of a well: `units` of displacement and drive, `where` its side and its name."""
    (z, drive), (side, name) = units, where

    def place(*values: float) -> float:
        return well_of(force(values), side)

    def rate(*values: float) -> float:
        return math.sqrt(stiffness_at(force(values), place(*values)))

    found = [
        *derive(f"displacement{name}", z, place, *parameters),
        *derive(f"natural frequency{name}", "Hz", lambda *v: rate(*v) / (2.0 * math.pi), *parameters),
        *_of_damping(name, nominal.get("damping"), rate, *parameters),
    ]
    gain = nominal.get("drive_gain")
    if gain is not None and drive:
        of = _in(f"({z})/s**2/({gain.unit})", drive, lambda g, *v: barrier_of(force(v), place(*v)) / abs(g))
        found += derive(f"steady drive that leaves rest{name}", drive, of, gain, *parameters)
    return found


def _of_forces(estimates: Estimates, units: Mapping[str, str]) -> list[Derived]:
    """Return every force per mass of a mechanism as a drive, and a constant drive as a displacement."""
    nominal, drive = estimates.get("", {}), units.get("drive", "")
    gain = nominal.get("drive_gain")
    found: list[Derived] = []
    for mechanism, parameters in estimates.items():
        for name, one in parameters.items():
            if mechanism and drive and gain is not None and _is_force(one.unit):
                of = _in(f"({one.unit})/({gain.unit})", drive, lambda a, g: a / abs(g))
                found += derive(f"{mechanism}, {name} as a drive", drive, of, one, gain)
    return found


def _of_rest(estimates: Estimates, units: Mapping[str, str]) -> list[Derived]:
    """Return a constant drive as a displacement against the spring."""
    nominal, z = estimates.get("", {}), units.get("displacement", "")
    gain, stiffness = nominal.get("drive_gain"), nominal.get("stiffness")
    offset = estimates.get(REST[0], {}).get(REST[1])
    if not z or offset is None or gain is None or stiffness is None or not stiffness.value > 0.0:
        return []
    of = _in(f"({gain.unit})*({offset.unit})/({stiffness.unit})", z, lambda g, u, k: g * u / k)
    return derive("rest position moved by drive.offset", z, of, gain, offset, stiffness)


def _is_force(unit: str) -> bool:
    """Return whether `unit` is that of a force per mass: of a length or an angle over a time squared."""
    bare = plain_unit(unit).replace(" ", "")
    return bare.endswith(("/s^2", "/s**2")) and not bare.startswith(("1/", "("))


def _in(unit: str, to: str, of: Callable[..., float]) -> Callable[..., float]:
    """Return `of`, whose results are in `unit`, with results in `to`."""
    factor = convert(1.0, unit, to)
    return lambda *values: factor * of(*values)
