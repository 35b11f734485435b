"""Chosen columns to the tables [signals.<name>] of a manifest: units, scales and holds, or what must be asked."""

from __future__ import annotations

import shlex
from collections.abc import Mapping

from rtctl.border.errors import InputError
from rtctl.measured.proposal.between_rows.hold import find_hold
from rtctl.measured.proposal.given import NONE, Given
from rtctl.measured.proposal.naming.column_names import STRONG
from rtctl.measured.proposal.naming.column_units import (
    Unit,
    as_written,
    given_unit,
    own_scale,
    read_column,
)
from rtctl.measured.proposal.naming.unit_roles import check_motion, check_swapped, doubts_about_units
from rtctl.measured.proposal.proposal import Answers, Open, SignalGuess
from rtctl.measured.proposal.roles import Choice, Roles
from rtctl.measured.proposal.scales import given_scales, scale_of
from rtctl.measured.proposal.survey import Survey
from rtctl.measured.stated_unit import NamedScale
from rtctl.measured.units import is_one
from rtctl.registry import PlantKind


def propose_signals(
    survey: Survey, kind: PlantKind, roles: Roles, given: Mapping[str, Given], answers: Answers
) -> tuple[tuple[SignalGuess, ...], list[Open], list[str]]:
    """Return the tables of signals, questions about their units, and doubts."""
    found: list[SignalGuess] = []
    scales = given_scales(answers.scales, kind.signals)
    opens: list[Open] = []
    unsure: list[str] = []
    read: dict[str, Unit] = {}
    with_unit = [
        name for name, one in roles.chosen.items() if read_column(survey.columns[one.column]).unit.text
    ]
    for name in kind.signals:
        if name in roles.undriven:
            found.append(_undriven(name, kind, roles.undriven[name]))
        if name not in roles.chosen:
            continue
        choice = roles.chosen[name]
        column = survey.columns[choice.column]
        reading = read_column(column)
        unit = _unit(given.get(name), name, reading.unit)
        if not (unit.text or unit.doubt) and is_one(kind.signals[name].like):
            unit = Unit("1", "as in the model, since nobody states one")
        scale = scale_of(scales, name, choice.column, unit.text)
        if scale is not None:
            unit = Unit(scale.unit, scale.why)
        others = [one for one in kind.responses if one in with_unit and one != name]
        weak = max(reading.votes.values(), default=0.0) < STRONG
        if not unit.text and kind.signals[name].optional and others and weak and not choice.certain:
            roles.left_out[choice.column] = (
                f"may be the {name}, but nobody states its unit: --output {name}={choice.column}:UNIT"
            )
            continue
        check_motion(name, choice.column, unit.text)
        if not unit.text:
            opens.append(_unit_question(name, kind, choice, unit, own_scale(column)))
        unsure += _doubts_about_unit(
            name, choice, unit, own_scale(column), reading.doubt if scale is None else ""
        )
        read[name] = reading.unit
        role = kind.signals[name].role
        held = (
            find_hold(answers.hold, name, column.name, column.values, survey.texts)
            if role == "input"
            else None
        )
        unsure += held.doubts if held else ()
        found.append(SignalGuess(name=name, role=role, column=choice.column, why=choice.why, unit=unit.text,
                                 unit_source=unit.source, certain=choice.certain,
                                 hold=held and held.hold, hold_why=held.why if held else "",
                                 scale=None if scale is None else scale.value))  # fmt: skip
    driven = [one for one in found if one.constant is None]
    check_swapped(driven, read)
    return tuple(found), opens, [*unsure, *doubts_about_units(driven, read)]


def _undriven(name: str, kind: PlantKind, why: str) -> SignalGuess:
    """Return the table of an input that is 0 and that no column has."""
    unit = kind.signals[name].unit or kind.signals[name].like or "N"
    return SignalGuess(
        name=name, role="input", column=NONE, why=why, constant=0.0, unit=unit, unit_source="0 in any unit"
    )


def _unit(given: Given | None, name: str, read: Unit) -> Unit:
    if given is None or not given.unit:
        return read
    try:
        return given_unit(given.unit, name)
    except ValueError as error:
        raise InputError(f'unit of the {name}, column "{given.column}": {error}') from None


def _doubts_about_unit(
    name: str, choice: Choice, unit: Unit, scale: NamedScale | None, doubt: str
) -> list[str]:
    """Return what should be looked at of a unit: the scale in the column's name, and what its words leave open."""
    if unit.source != "given":
        return [f'{name}: column "{choice.column}": {doubt}'] if doubt else []
    if scale is None:
        return []
    return [
        f'{name}: column "{choice.column}" is read in {as_written(unit.text)}, as you said, and the scale in its name, '
        f'"{scale.text}", is not applied'
    ]


def _unit_question(name: str, kind: PlantKind, choice: Choice, unit: Unit, scale: NamedScale | None) -> Open:
    role = kind.signals[name].role
    named = kind.free_signals or role == "output"
    option = f"--{role} {shlex.quote(f'{name}=' * named + f'{choice.column}:UNIT')}"
    because = f" ({unit.doubt})" if unit.doubt else ""
    if scale is not None:
        text = (
            f'whether the numbers of column "{choice.column}", the {name}, were made by the scale in its name, '
            f'"{scale.text}", does not show: give their unit as they stand, or what one of them counts'
        )
        return Open(f"unit.{name}", text, f"{option} or --scale '{name}={scale.per_number:.6g} UNIT'")
    text = f'nobody states the unit of column "{choice.column}", the {name}{because}'
    if unit.contradicts:
        text = f'the unit of column "{choice.column}", the {name}, is not clear: {unit.doubt}'
    return Open(f"unit.{name}", text, option)
