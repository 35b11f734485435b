"""Units of a motion of which only a time derivative was measured."""

from __future__ import annotations

from collections.abc import Mapping

from rtctl.border.units.quantities import is_angle, unit_registry

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Responses of a motion, each with its number of time derivatives."""


def lowest_response(units: Mapping[str, str]) -> str:
    """Return the lowest derivative of the displacement among signals with `units`; "" where there is no response."""
    return next((name for name in DERIVATIVES if name in units), "")


def held_response(signal: str, unit: str) -> str:
    """Return the unit in which a response that people read in `unit` is held, so that its displacement has a plain one.

    That is `unit` where it is a plain unit per second: "mm/s". Another one is held in m or rad per second: "g_0" in
    "m/s^2". What is neither a length nor an angle, as a voltage, stays as it is.
    """
    order = DERIVATIVES[signal]
    displacement = unit_registry().parse_units(unit) * unit_registry().second ** order
    factors = list(displacement._units.items())
    if order == 0 or (len(factors) == 1 and factors[0][1] == 1):
        return unit
    per_time = "/s" if order == 1 else f"/s^{order}"
    if displacement.dimensionality == unit_registry().meter.dimensionality:
        return f"m{per_time}"
    return f"rad{per_time}" if is_angle(str(displacement)) else unit


def with_displacement(units: Mapping[str, str]) -> dict[str, str]:
    """Return `units` by signal with that of "displacement", derived from its lowest measured derivative if need be.

    Of "mm/s" it is "mm", of "g_0" it is "m" (`held_response`); units of no response stay as they are.
    """
    source = lowest_response(units)
    if source in ("", "displacement"):
        return dict(units)
    registry = unit_registry()
    held = registry.parse_units(held_response(source, units[source]))
    return {**units, "displacement": f"{held * registry.second ** DERIVATIVES[source]:~C}"}
