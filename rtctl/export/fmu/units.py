"""Units of variables as FMI writes them: a factor and exponents of the SI base units."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from rtctl.border.units.quantities import unit_registry

BASE = {
    "kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol", "candela": "cd",
    "radian": "rad",
}  # fmt: skip
"""Name in FMI of each base unit."""


class BaseUnit(NamedTuple):
    """Exponents of the base units, and how many of their product one unit is."""

    exponents: dict[str, int]
    factor: float


def base_unit(unit: str) -> BaseUnit | None:
    """Return a unit in base units; None where it has no such form (a root, a count, a logarithm)."""
    quantity = unit_registry().Quantity(1.0, unit_registry().parse_units(unit))
    if not quantity._is_multiplicative:
        return None
    in_base = quantity.to_base_units()
    exponents: dict[str, int] = {}
    for name, power in dict(in_base.units._units).items():
        if name not in BASE or not float(power).is_integer():  # type: ignore[arg-type]
            return None
        exponents[BASE[name]] = int(float(power))  # type: ignore[arg-type]
    return BaseUnit(exponents, float(in_base.magnitude))


def add_unit_definitions(root: Element, units: list[str]) -> None:
    """Add `UnitDefinitions` for `units`, each once, in their order."""
    definitions = SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(units):
        element = SubElement(definitions, "Unit", name=unit)
        in_base = base_unit(unit)
        if in_base is not None:
            attributes = {name: str(power) for name, power in in_base.exponents.items()}
            if in_base.factor != 1.0:
                attributes["factor"] = repr(in_base.factor)
            SubElement(element, "BaseUnit", attributes)
