"""The unit of a column, who states it, and which quantities are measured in it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from rtctl.border.units.quantities import is_angle, unit_registry
from rtctl.measured.amplitude_unit import AmplitudeUnit, is_level, is_named_logarithm
from rtctl.measured.proposal.naming.column_names import STRONG, Name, is_weight, read_name, unit_meanings
from rtctl.measured.proposal.survey import Column
from rtctl.measured.stated_unit import (
    NamedScale,
    column_amplitude,
    is_no_unit,
    scale_in_name,
    stated_amplitude,
)
from rtctl.measured.units import check_unit, is_proportional, same_unit

UNIT_VOTE = 3.0
"""Vote of a unit for the quantity that is measured in it: above a letter's, below a word's."""
LOGARITHM = "a logarithm, which is no signal: export it in a linear unit"
AS_GRAVITY = "taken as standard gravity, 9.80665 m/s^2"
MOTIONS = ("displacement", "velocity", "acceleration")
OUTPUTS = (*MOTIONS, "deflection", "response", "resistance")
_MEASURE = {
    "m": "displacement", "m/s": "velocity", "m/s^2": "acceleration", "s": "time", "V": "drive", "N": "drive",
    "A": "current", "ohm": "resistance", "Hz": "none", "K": "none", "Pa": "drive", "T": "drive", "A/m": "drive",
    "N*m": "drive", "rad/s^2": "acceleration",
}  # fmt: skip
"""Quantity that is measured in units like this one."""


class Unit(NamedTuple):
    """The unit of a column."""

    text: str
    """As pint reads it; "" where nobody states one."""
    source: str
    """Who states it, as the end of a sentence."""
    doubt: str = ""
    """What a reader should know of it; "": nothing."""
    contradicts: bool = False
    """Whether its name and its file state two, of which nobody knows which is right."""


class Reading(NamedTuple):
    """What name and unit of a column say."""

    votes: dict[str, float]
    unit: Unit
    doubt: str = ""


def read_column(column: Column) -> Reading:
    """Return the votes and the unit of a column, by its name and by what its file states."""
    name = read_name(column.label or column.name)
    unit = _unit(column, name)
    if scale := own_scale(column):  # its unit tells what was measured, and not what its numbers count
        votes, _ = _joint_votes(name.votes, quantity_of(unit.text) if unit.text else "")
        return Reading(votes, Unit("", "", f'its name has the scale "{scale.text}"'))
    if not unit.text:
        return Reading(name.votes, unit)
    votes, doubt = _joint_votes(name.votes, quantity_of(unit.text))
    return Reading(votes, unit, doubt or unit.doubt)


def amplitude_of(column: Column) -> AmplitudeUnit | None:
    """Return what the amplitudes in a column are, by its unit and its name; None: nobody says more than a unit."""
    name = column.label or column.name
    stated = column.unit if column.unit is not None and not is_no_unit(column.unit) else None
    return column_amplitude(name, stated or read_name(name).unit or None)


def unit_of_amplitude(text: str) -> str:
    """Return the unit of an amplitude as pint reads it, best one of a motion; "": it has none."""
    found = unit_meanings(text) if text else ()
    return _chosen(found, next((quantity_of(one) for one in found if quantity_of(one) in MOTIONS), ""))


def own_scale(column: Column) -> NamedScale | None:
    """Return the scale that the name of a column has in it, not that of its group; None: it has none."""
    place = column.place
    return scale_in_name(place.within(place.groups[-1]) if place.groups else column.name)


def told_logarithm(column: Column, *, named: bool = True) -> str:
    """Return that a column is a logarithm, as a phrase that continues its name; "": it is none.

    It is by its unit or, where `named`, by its name.
    """
    if is_in_decibels(column):
        return f"is in dB, {LOGARITHM}"
    is_named = named and is_named_logarithm(column.label or column.name)
    return f"is by its name {LOGARITHM}" if is_named else ""


def is_in_decibels(column: Column) -> bool:
    """Return whether a column is in decibels, by its unit or its name."""
    found = amplitude_of(column)
    return found is not None and found.is_level


def given_unit(text: str, quantity: str) -> Unit:
    """Return a unit that the user gave, such as `g` of an acceleration. Raises ValueError where it is none."""
    if is_level(text):
        raise ValueError(
            f'"{text}" is a logarithm, which no signal in time is; of a sweep say what 0 dB is: "dB re 1 um"'
        )
    found = _chosen(unit_meanings(text), quantity) or text
    check_unit(found)
    return Unit(found, "given")


def as_written(unit: str) -> str:
    """Return a unit as people write it: standard gravity as g."""
    return "g" if unit == "g_0" else unit


@cache
def quantity_of(unit: str) -> str:
    """Return the quantity that is measured in a readable unit; "" where none that is known here is."""
    registry = unit_registry()
    parsed = registry.parse_units(unit)
    if not parsed.dimensionality and not is_proportional(unit):
        return ""  # a logarithm, which stands in no product
    if is_angle(unit):
        return "displacement"
    if is_angle(str(parsed * registry.second)) and parsed.dimensionality == registry.hertz.dimensionality:
        return "velocity" if "rad" in unit or "deg" in unit else "none"
    for known, quantity in _MEASURE.items():
        if parsed.dimensionality == registry.parse_units(known).dimensionality:
            return quantity
    return ""


def is_force(unit: str) -> bool:
    """Return whether a readable unit measures a force."""
    registry = unit_registry()
    return bool(registry.parse_units(unit).dimensionality == registry.newton.dimensionality)


def _unit(column: Column, name: Name) -> Unit:
    """Return the unit of a column: what the file states comes before its name."""
    stated = column.unit
    wanted = max(name.votes, key=lambda one: name.votes[one]) if name.votes else ""
    if stated is not None and not is_no_unit(stated):
        text, source = stated, f'the file states "{stated[:40]}"'
    elif name.unit:
        text, source = name.unit, f'its name has "{name.unit}" {name.habit}'
    else:
        return Unit("", "")
    if (amplitude := stated_amplitude(text)) is not None:
        return _of_amplitudes(amplitude, source)
    found = _chosen(unit_meanings(text), wanted)
    if not found:
        return Unit("", "", f"{source}, which is no known unit")
    if source.startswith("the file") and name.habit == "in brackets" and not _agree(found, name.unit):
        return Unit("", "", f'{source}, its name "{name.unit}"; if the name is right, correct the file', True)
    if found == "g_0" and is_weight(column.label or column.name):
        return Unit("", "", f"{source}, which may be grams, gram-force or gravity")
    return Unit(found, source, _two_meanings(text, found))


def _agree(unit: str, named: str) -> bool:
    """Return whether a readable unit is one meaning of the unit in a name, or that has none, as `Channel (A)` in V."""
    meant = [one for one in unit_meanings(named) if len(named) > 1 or quantity_of(one) == quantity_of(unit)]
    return not meant or any(same_unit(unit, one) for one in meant)


def _of_amplitudes(amplitude: AmplitudeUnit, source: str) -> Unit:
    """Return the unit of a column of readings at instants: that of a peak value is as large, no other is one."""
    if amplitude.is_level:
        return Unit("", "", f"{source}, which is a logarithm")
    if amplitude.convention != "peak":
        return Unit("", "", f"{source}, which no reading at an instant is")
    unit = unit_of_amplitude(amplitude.unit)
    return Unit(unit, source, f"{source}: its rows are taken as readings at instants, in {unit}")


def _chosen(found: Sequence[str], quantity: str) -> str:
    """Return the meaning of a unit that measures something known, best the quantity; the first where none does."""
    if "g_0" in found:
        return "g_0" if quantity not in ("none", "time") else found[0]
    for one in found:
        if quantity and quantity_of(one) == quantity:
            return one
    return found[0] if found else ""


def _two_meanings(stated: str, taken: str) -> str:
    return f'"{stated}" is {AS_GRAVITY}' if taken == "g_0" else ""


def _joint_votes(named: dict[str, float], measured: str) -> tuple[dict[str, float], str]:
    """Return the votes of name and unit together, and a doubt where they disagree."""
    if not measured:
        return named, ""
    if measured == "none":
        return {"none": STRONG}, ""
    votes = dict(named)
    letters = ("velocity", "acceleration")  # v and a: of a voltage or an amplifier as often as of a motion
    outputs = {
        one: vote for one, vote in named.items() if one in OUTPUTS and (vote >= STRONG or one not in letters)
    }
    output = max(outputs.values(), default=0.0)
    driven = named.get("drive", 0.0)
    if measured in MOTIONS:
        told = [one for one in MOTIONS if named.get(one) and one != measured]
        votes = {one: vote for one, vote in votes.items() if one not in told}
        sure = [one for one in told if named[one] >= STRONG]
        doubt = f"its name says {sure[0]}, its unit {measured}: the unit decides" if sure else ""
        if driven < STRONG:
            votes[measured] = votes.get(measured, 0.0) + UNIT_VOTE
        return votes, doubt
    if measured in ("drive", "current") and output and driven < output:
        return votes, ""  # of a sensor that is not calibrated
    votes = {one: vote for one, vote in votes.items() if one not in OUTPUTS or one in outputs}
    votes[measured] = votes.get(measured, 0.0) + UNIT_VOTE
    return votes, ""
