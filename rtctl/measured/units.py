"""Units of measured columns: read by pint, converted for a whole column at once."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pint

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import nearest
from rtctl.border.quantities import unit_registry

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

ROUNDING = 1e-9
"""Relative difference of two units below which they are one."""
LONGEST = 80
"""Characters of a unit; longer texts are none."""
_TOWER = re.compile(r"(\*\*|\^)[\s(+-]*[\d.]+[\s)]*(\*\*|\^)|\d{5}|(\*\*|\^)[\s(+-]*\d{3}")
"""Powers of powers and large numbers, which would be worked out for ever."""


def check_unit(unit: str, to: str | None = None) -> None:
    """Check that pint reads `unit` and that it converts to `to`. Raises ValueError in words."""
    known = _parsed(unit)
    if to is not None and known.dimensionality != _parsed(to).dimensionality:
        raise ValueError(f'unit "{unit}" is not compatible with {to}')


def is_unit(unit: Any) -> bool:
    """Return whether `unit` is a text that pint reads."""
    try:
        return isinstance(unit, str) and _parsed(unit) is not None
    except ValueError:
        return False


def check_proportional(unit: str) -> None:
    """Raise ValueError for a unit in which no equation of motion holds, as its zero means something: dB and degC."""
    if not is_proportional(unit):
        raise ValueError(
            f'"{unit}" is a logarithm or has its zero elsewhere, and no equation of motion holds in it; convert the '
            "column (dB to V, degC to K)"
        )


def check_is_no(unit: str, others: tuple[str, ...]) -> None:
    """Raise ValueError where a unit measures what one of the `others` does, which the signal cannot be."""
    for other in others:
        if _parsed(unit).dimensionality == _parsed(other).dimensionality:
            what = f'"{unit}" is a unit like {other}'
            if _parsed(unit) == _parsed("g"):
                what = '"g" is the gram; standard gravity is "g_0"'
            raise ValueError(f"{what}, which this signal cannot be; correct the unit or the signal")


def same_unit(one: str, other: str) -> bool:
    """Return whether two readable units mean the same scale, to rounding."""
    first, second = _parsed(one), _parsed(other)
    if first == second:
        return True
    if first.dimensionality != second.dimensionality or not is_proportional(one, other):
        return False
    factor = float(unit_registry().Quantity(1.0, first).to(second).magnitude)
    return abs(factor - 1.0) < ROUNDING


def is_proportional(*units: str) -> bool:
    """Return whether zero of each readable unit means nothing: not so of degC and dB."""
    return all(unit_registry().Quantity(1.0, _parsed(unit))._is_multiplicative for unit in units)


def convert_column(values: FloatArray, unit: str, to: str) -> FloatArray:
    """Convert `values` (n,) [unit] to `to`. Raises ValueError in words for an unknown or incompatible unit."""
    check_unit(unit, to)
    if same_unit(unit, to):
        return values
    converted = unit_registry().Quantity(values, unit).to(to).magnitude
    return np.ascontiguousarray(converted, dtype=np.float64)


def _parsed(unit: str) -> pint.Unit:
    if len(unit) > LONGEST or "√" in unit or _TOWER.search(unit):  # pint passes over the root
        raise ValueError(f'unit "{unit[:LONGEST]}" cannot be read; write it like "mm/s^2"')
    try:
        return unit_registry().parse_units(unit)
    except pint.UndefinedUnitError:
        raise ValueError(f'unknown unit "{unit}"{nearest(unit, _COMMON)}') from None
    except Exception as error:  # pint lets tokenizer, assertion and type errors through
        raise ValueError(f'unit "{unit}" cannot be read: {error}; write it like "mm/s^2"') from None
