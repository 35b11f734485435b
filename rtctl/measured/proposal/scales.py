"""What the user says of a transducer, `NAME=NUMBER UNIT`, as the scale of a signal: signal = scale * column.

A column in V and a force cell of 22.4 mV/N give N: the number is a sensitivity where its unit begins with what the
column is in, a scale (44.6 N/V) where it ends with that, and of a column of counts the size of one count (0.3 mV).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import QUANTITY, convert
from rtctl.measured.proposal.naming.column_units import given_unit, quantity_of
from rtctl.measured.units import check_unit, is_proportional, is_unit

EXAMPLE = "--scale 'drive=22.4 mV/N'"


class Scale(NamedTuple):
    """Scale of a signal."""

    value: float
    """Scale [unit of the signal per number of the column]."""
    unit: str
    """Unit of the signal."""
    why: str


def given_scales(texts: Collection[str], signals: Collection[str]) -> dict[str, str]:
    """Return the quantities of `NAME=NUMBER UNIT`, by signal. Raises InputError in words."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, quantity = (one.strip() for one in text.partition("="))
        if not equals or not quantity:
            raise InputError(f"--scale {text}: is not NAME=NUMBER UNIT, such as {EXAMPLE}")
        if name not in signals:
            raise InputError(f'--scale {text}: no signal "{name}"{nearest(name, signals)}')
        if name in found:
            raise InputError(f"--scale {text}: {name} is given twice; keep one")
        found[name] = quantity
    return found


def scale_of(said: Mapping[str, str], name: str, column: str, unit: str) -> Scale | None:
    """Return the scale of a signal; None: the user said none.

    Args:
        said: Quantities by signal, of `given_scales`.
        name: The signal.
        column: Its column.
        unit: Unit of the column; "": nobody states one, it holds counts.

    Raises:
        InputError: The quantity cannot be read, or does not fit the column.
    """
    if name not in said:
        return None
    option = f"--scale '{name}={said[name]}'"
    number = QUANTITY.match(said[name])
    value = float(number[1]) if number else 0.0
    if number is None or not value or not abs(value) < float("inf"):
        raise InputError(f"{option}: is not NAME=NUMBER UNIT with a number that is not 0, such as {EXAMPLE}")
    text = number[2].strip()
    try:
        return _scale(value, text, name, unit, f"you said {said[name]}")
    except ValueError as error:
        raise InputError(f'{option}: {error} (column "{column}")') from None


def _scale(value: float, text: str, name: str, unit: str, why: str) -> Scale:
    if not unit:
        if is_unit(text) and not quantity_of(text):
            raise ValueError(
                f"nobody states the unit of the column, which {text} needs; give it with the column, such as "
                f"--input COLUMN:V"
            )
        return Scale(value, given_unit(text, name).text, f"{why} for each count")
    if not is_proportional(unit):
        raise ValueError(f"the column is in {unit}, whose zero means something: no scale fits it")
    over, below = _parts(text)
    if below and _is_like(below, unit) and not _is_like(over, unit):
        return Scale(
            value * convert(1.0, unit, below), given_unit(over, name).text, f"{why}, the column is in {unit}"
        )
    if below and _is_like(over, unit) and not _is_like(below, unit):
        found = convert(1.0, unit, over) / value
        return Scale(found, given_unit(below, name).text, f"{why}, a sensitivity; the column is in {unit}")
    raise ValueError(
        f'"{text}" does not tell what 1 {unit} of the column is; write a sensitivity such as "22.4 {unit}/N" or a '
        f'scale such as "44.6 N/{unit}"'
    )


def _parts(text: str) -> tuple[str, str]:
    """Return what stands over and below the last slash that is in no brackets: of `mV/(m/s^2)` mV and m/s^2."""
    depth, cut = 0, -1
    for k, letter in enumerate(text):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if letter == "/" and depth == 0:
            cut = k
    if cut < 0:
        return text, ""
    return text[:cut].strip(), text[cut + 1 :].strip().removeprefix("(").removesuffix(")").strip()


def _is_like(text: str, unit: str) -> bool:
    if not is_unit(text):
        return False
    try:
        check_unit(text, unit)
    except ValueError:
        return False
    return True
