"""The unit that a text names, read by pint within limits: no text takes long."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import pint

from rtctl.border.errors import nearest
from rtctl.border.units.quantities import QUANTITY, check_unit_text, unit_registry

_COMMON = (
    *(
        "m",
        "mm",
        "um",
        "nm",
        "m/s",
        "mm/s",
        "m/s^2",
        "mm/s^2",
        "V",
        "mV",
        "A",
        "mA",
        "uA",
        "N",
        "mN",
        "s",
        "ms",
    ),
    *("ohm", "kohm", "Mohm", "T", "mT", "A/m", "rad", "deg", "degC", "K", "Hz", "Pa", "dimensionless"),
)

LARGEST_POWER = 20.0
"""Power of a unit, beyond which its factor is no number of floating point."""
SI = "SI"
"""Unit of a quantity that is in SI base units, whichever they are."""


def parsed_unit(unit: str) -> pint.Unit:
    """Return the unit; "" is a plain number. Raises ValueError in words, with the nearest unit that people use."""
    check_unit_text(unit)
    try:
        parsed = unit_registry().parse_units(unit)
        _ = parsed.dimensionality  # of a product with a logarithm there is none
        largest = max((abs(float(power)) for power in dict[str, Any](parsed._units).values()), default=0.0)
    except pint.UndefinedUnitError as error:
        if "delta_" in str(error) and "delta_" not in unit:
            raise ValueError(f'unit "{unit}" is a product with a logarithm, and has no meaning') from None
        raise ValueError(f'unknown unit "{unit}"{nearest(unit, _COMMON)}') from None
    except Exception as error:  # pint lets tokenizer, assertion and type errors through
        raise ValueError(f'unit "{unit}" cannot be read: {error}; write it like "mm/s^2"') from None
    if not largest <= LARGEST_POWER:
        raise ValueError(f'unit "{unit}" cannot be read: a power of {largest:g}; write it like "mm/s^2"')
    return parsed


@cache
def common_units() -> frozenset[pint.Unit]:
    """Return the units that people use for signals."""
    return frozenset(parsed_unit(one) for one in _COMMON)


def parse_base_quantity(raw: Any) -> float:
    """Return a quantity such as "3 cm" in SI base units; "0.03 SI" is one that is in them already.

    Raises:
        ValueError: In words; also for a number without a unit, which would be a guess.
    """
    match = QUANTITY.match(raw.strip()) if isinstance(raw, str) else None
    if match is None or not match[2]:
        raise ValueError(
            f'a quantity is "<number> <unit>", such as "3 cm" ("dimensionless" of a number), got {raw!r}'
        )
    number, unit = float(match[1]), match[2]
    value = number
    if unit != SI:
        value = float(unit_registry().Quantity(number, parsed_unit(unit)).to_base_units().magnitude)
    if not math.isfinite(value):
        raise ValueError(f"must be finite, got {raw!r}")
    return value
