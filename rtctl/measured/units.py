"""Units of measured columns: read by pint, converted for a whole column at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.units.quantities import QUANTITY, unit_registry
from rtctl.border.units.unit_text import parsed_unit

ROUNDING = 1e-9
"""Relative difference of two units below which they are one."""


def check_unit(unit: str, to: str | None = None) -> None:
    """Check that pint reads `unit` and that it converts to `to`. Raises ValueError in words."""
    known = parsed_unit(unit)
    if to is not None and known.dimensionality != parsed_unit(to).dimensionality:
        raise ValueError(f'unit "{unit}" is not compatible with {to}{_about_weights(unit)}')


def count_s(unit: str) -> float:
    """Return what one count of a time is [s]: of a unit (`ms`), a number of it (`16.67 ns`), a clock's tick (`60 MHz`).

    Raises:
        ValueError: In words, for a text that is none of these.
    """
    number = QUANTITY.match(unit.strip())
    if number is None or not number[2]:
        return float(convert_column(np.ones(1), unit, "s")[0])
    value = float(number[1])
    if not 0.0 < value < np.inf:
        raise ValueError(
            f'unit of time "{unit}": the number must be > 0; write it like "60 MHz" or "16.67 ns"'
        )
    of_clock = parsed_unit(number[2]).dimensionality == parsed_unit("Hz").dimensionality
    size = float(convert_column(np.array([value]), number[2], "Hz" if of_clock else "s")[0])
    return 1.0 / size if of_clock else size


def same_count(one: str, other: str) -> bool:
    """Return whether one count of two units of time is the same, to rounding. Raises ValueError as `count_s` does."""
    return abs(count_s(one) / count_s(other) - 1.0) < ROUNDING


def is_clock(text: str) -> bool:
    """Return whether a text is the rate of a clock, `60 MHz`, whose ticks a column may count."""
    number = QUANTITY.match(text.strip())
    if number is None or not number[2] or not is_unit(number[2]):
        return False
    return bool(parsed_unit(number[2]).dimensionality == parsed_unit("Hz").dimensionality)


def is_unit(unit: Any) -> bool:
    """Return whether `unit` is a text that pint reads."""
    try:
        return isinstance(unit, str) and parsed_unit(unit) is not None
    except ValueError:
        return False


def check_proportional(unit: str) -> None:
    """Raise ValueError for a unit in which no equation of motion holds, as its zero means something: dB and degC."""
    if not is_proportional(unit):
        held = absolute_unit(unit)
        scale = "" if held.scale is None else f" and scale = {held.scale:.9g}"
        remedy = (
            "convert the column (dB to V)"
            if held.unit == unit
            else f'write unit = "{held.unit}" with offset = {held.offset:.9g}{scale}, which convert the column '
            f"({unit} to {held.unit})"
        )
        raise ValueError(
            f'"{unit}" is a logarithm or has its zero elsewhere, and no equation holds in it; {remedy}'
        )


def check_is_no(unit: str, others: tuple[str, ...]) -> None:
    """Raise ValueError where a unit measures what one of the `others` does, which the signal cannot be."""
    for other in others:
        if parsed_unit(unit).dimensionality == parsed_unit(other).dimensionality:
            what = f'"{unit}" is a unit like {other}'
            if parsed_unit(unit) == parsed_unit("g"):
                what = '"g" is the gram; standard gravity is "g_0"'
            raise ValueError(
                f"{what}, which this signal cannot be; correct the unit or the signal{_about_weights(unit)}"
            )


def _about_weights(unit: str) -> str:
    """Return what a unit of mass may mean, as a weight and as a part of standard gravity; "": it is of none."""
    if parsed_unit(unit).dimensionality != parsed_unit("g").dimensionality:
        return ""
    registry = unit_registry()
    weight = float(
        (registry.Quantity(1.0, parsed_unit(unit)) * registry.Quantity(1.0, "g_0")).to("N").magnitude
    )
    text = f". As a weight it is a force: rtctl init --scale 'SIGNAL={weight:.9g} N/{unit}'"
    if unit.endswith("g") and unit != "kg":
        text += f"; as standard gravity an acceleration: --scale 'SIGNAL={1e3 * weight:.9g} m/s^2/{unit}'"
    return text


def same_unit(one: str, other: str) -> bool:
    """Return whether two readable units mean the same scale, to rounding."""
    first, second = parsed_unit(one), parsed_unit(other)
    if first == second:
        return True
    if first.dimensionality != second.dimensionality or not is_proportional(one, other):
        return False
    factor = float(unit_registry().Quantity(1.0, first).to(second).magnitude)
    return abs(factor - 1.0) < ROUNDING


def is_one(unit: str) -> bool:
    """Return whether a text is the unit of plain numbers: 1."""
    return bool(unit) and is_unit(unit) and same_unit(unit, "1")


def is_proportional(*units: str) -> bool:
    """Return whether zero of each readable unit means nothing: not so of degC and dB."""
    return all(unit_registry().Quantity(1.0, parsed_unit(unit))._is_multiplicative for unit in units)


class Absolute(NamedTuple):
    """A unit whose zero is none of the quantity, and how a column is brought into it: scale * column + offset."""

    unit: str
    scale: float | None = None
    """None: 1."""
    offset: float | None = None
    """Offset [unit]; None: 0."""


def absolute_unit(unit: str) -> Absolute:
    """Return K with scale and offset for degC and degF, every other unit as it is."""
    if (
        not unit
        or not is_unit(unit)
        or is_proportional(unit)
        or parsed_unit(unit).dimensionality != parsed_unit("K").dimensionality
    ):
        return Absolute(unit)
    registry = unit_registry()
    zero, one = (float(registry.Quantity(value, parsed_unit(unit)).to("K").magnitude) for value in (0.0, 1.0))
    scale = one - zero
    return Absolute("K", None if abs(scale - 1.0) < ROUNDING else scale, round(zero, 9))


def convert_column(values: FloatArray, unit: str, to: str) -> FloatArray:
    """Convert `values` (n,) [unit] to `to`. Raises ValueError in words for an unknown or incompatible unit."""
    check_unit(unit, to)
    if same_unit(unit, to):
        return values
    converted = unit_registry().Quantity(values, unit).to(to).magnitude
    return np.ascontiguousarray(converted, dtype=np.float64)


def is_angular(unit: str) -> bool:
    """Return whether a readable unit of frequency counts angles, 2 pi for each cycle: rad/s, deg/s, rpm."""
    base = unit_registry().Quantity(1.0, parsed_unit(unit)).to_base_units().units
    return base == unit_registry().parse_units("rad/s")


def convert_frequency(values: FloatArray, unit: str) -> FloatArray:
    """Convert frequencies or angular frequencies (n,) [unit] to Hz. Raises ValueError in words for another unit."""
    per_s = convert_column(values, unit, "1/s")
    return per_s / (2.0 * np.pi) if is_angular(unit) else per_s
