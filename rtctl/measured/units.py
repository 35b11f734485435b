"""Units of measured columns: read by pint, converted for a whole column at once."""

from __future__ import annotations

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


def same_unit(one: str, other: str) -> bool:
    """Return whether two readable units mean the same scale."""
    return bool(_parsed(one) == _parsed(other))


def convert_column(values: FloatArray, unit: str, to: str) -> FloatArray:
    """Convert `values` (n,) [unit] to `to`. Raises ValueError in words for an unknown or incompatible unit."""
    check_unit(unit, to)
    if same_unit(unit, to):
        return values
    converted = unit_registry().Quantity(values, unit).to(to).magnitude
    return np.ascontiguousarray(converted, dtype=np.float64)


def _parsed(unit: str) -> pint.Unit:
    try:
        return unit_registry().parse_units(unit)
    except pint.UndefinedUnitError:
        raise ValueError(f'unknown unit "{unit}"{nearest(unit, _COMMON)}') from None
    except Exception as error:  # pint lets tokenizer, assertion and type errors through
        raise ValueError(f'unit "{unit}" cannot be read: {error}; write it like "mm/s^2"') from None
