"""Whether the unit of a column fits the signal that it is: a drive in mm beside a displacement in V is swapped.

A sensor without calibration is read in V, and a base may be driven in m/s^2: each alone is possible, and told.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence

from rtctl.border.errors import InputError
from rtctl.measured.proposal.naming.column_units import MOTIONS, Unit, as_written, is_force, quantity_of
from rtctl.measured.proposal.proposal import SignalGuess
from rtctl.measured.units import same_unit

PRESCRIBED = ("displacement", "velocity")
"""Motions that hardly ever are the drive; an acceleration is, where a base is shaken."""
_ARTICLES = {"acceleration": "an"}


def check_motion(name: str, column: str, unit: str) -> None:
    """Raise InputError for a motion in the unit of another one: the user named the wrong signal."""
    measured = quantity_of(unit) if unit else ""
    if name in MOTIONS and measured in MOTIONS and measured != name:
        raise InputError(
            f'column "{column}" is read in {as_written(unit)}, as {_with_article(measured)} is: it cannot '
            f"be the {name}; say --output {shlex.quote(f'{measured}={column}')}, or correct the unit"
        )
    if name in MOTIONS and unit and is_force(unit):
        corrected = shlex.quote(f"{name}={column}:UNIT")
        raise InputError(
            f'column "{column}" is read in {unit}, as a force is: it cannot be the {name}; say '
            f"--input {shlex.quote(column)} if it is what drives, --output {corrected} if the unit is wrong"
        )


def check_swapped(signals: Sequence[SignalGuess], read: Mapping[str, Unit]) -> None:
    """Raise InputError where the drive is in the unit of a motion, and a response in the unit of a drive.

    Args:
        signals: The signals; one with a scale is calibrated, whatever its column is in.
        read: The unit that its column states, by signal; an empty one: the user's counts.
    """
    units = {one.name: read[one.name].text or one.unit for one in signals if one.scale is None}
    drive = next(
        (one for one in signals if one.role == "input" and _measures(units, one) in PRESCRIBED), None
    )
    response = next((one for one in signals if one.name in MOTIONS and _drives(units, one)), None)
    if drive is None or response is None:
        return
    motion, unit = _measures(units, drive), units[response.name]
    drives, moves = (
        shlex.quote(f"{name}{one.column}{'' if read[one.name].text else f':{one.unit}'}")
        for name, one in (("", response), (f"{motion}=", drive))
    )
    raise InputError(
        f'drive and response are swapped: the {drive.name} is column "{drive.column}" in {units[drive.name]}, as '
        f'{_with_article(motion)} is, and the {response.name} is column "{response.column}" in {unit}, as a drive '
        f"is; say --input {drives} --output {moves}. Where a sensor "
        f"does give its reading in {unit}, say its scale: --scale '{response.name}=NUMBER "
        f"{_example_unit(response.name)}/{unit}'"
    )


def doubts_about_units(signals: Sequence[SignalGuess], read: Mapping[str, Unit]) -> list[str]:
    """Return what should be looked at where a unit is unusual for its signal, or another one than the column's."""
    found = []
    for one in signals:
        measured = quantity_of(one.unit) if one.unit else ""
        if one.scale is not None:
            continue
        if one.unit_source == "given":
            found += _other_unit(one, read[one.name])
        if one.name in MOTIONS and measured not in ("", *MOTIONS):
            found.append(
                f'{one.name}: column "{one.column}" is in {one.unit}, in which no {one.name} is measured: an '
                f"uncalibrated sensor? The model is then of its reading. If its scale is known, say "
                f"--scale '{one.name}=NUMBER {_example_unit(one.name)}/{one.unit}'"
            )
        if one.name == "drive" and measured in PRESCRIBED:
            found.append(
                f'drive: column "{one.column}" is in {one.unit}, as {_with_article(measured)} is: is it what drives, '
                "and not the response? Else say --input COLUMN"
            )
    return found


def _other_unit(signal: SignalGuess, read: Unit) -> list[str]:
    """Return the doubt about a unit that the user gave where the column says another one."""
    if not read.text or same_unit(read.text, signal.unit):
        return []
    return [
        f'{signal.name}: column "{signal.column}" is read in {as_written(signal.unit)}, as you said, but {read.source}'
    ]


def _measures(units: Mapping[str, str], signal: SignalGuess) -> str:
    unit = units.get(signal.name, "")
    return quantity_of(unit) if unit else ""


def _drives(units: Mapping[str, str], signal: SignalGuess) -> bool:
    return _measures(units, signal) in ("drive", "current")


def _with_article(quantity: str) -> str:
    return f"{_ARTICLES.get(quantity, 'a')} {quantity}"


def _example_unit(motion: str) -> str:
    return {"displacement": "mm", "velocity": "mm/s"}.get(motion, "m/s^2")
