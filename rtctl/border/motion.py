"""Units of a motion of which only a time derivative was measured."""

from __future__ import annotations

from collections.abc import Mapping

from rtctl.border.quantities import unit_registry

DERIVATIVES = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Responses of a motion, each with its number of time derivatives."""


def lowest_response(units: Mapping[str, str]) -> str:
    """Return the lowest derivative of the displacement among signals with `units`; "" where there is no response."""
    return next((name for name in DERIVATIVES if name in units), "")


def with_displacement(units: Mapping[str, str]) -> dict[str, str]:
    """Return `units` by signal with that of "displacement", derived from its lowest measured derivative if need be.

    Of "mm/s" it is "mm"; units of no response stay as they are.
    """
    source = lowest_response(units)
    if source in ("", "displacement"):
        return dict(units)
    registry = unit_registry()
    times = registry.second ** DERIVATIVES[source]
    return {**units, "displacement": f"{registry.parse_units(units[source]) * times:~C}"}
