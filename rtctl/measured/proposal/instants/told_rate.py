"""A rate that a file tells apart from its columns: a variable such as `fs`, or a line above them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.measured.columns.time_axis import StatedPeriod, decimation, in_hz
from rtctl.measured.proposal.naming.column_units import read_column
from rtctl.measured.proposal.survey import Column, Survey
from rtctl.measured.readers.stated.rate import VARIABLES, rate_key, stated_period
from rtctl.measured.units import check_unit, convert_column


class ToldRate(NamedTuple):
    """A rate that a file tells apart from its columns."""

    source: str
    """What tells it: a variable, or a line of text."""
    rate_hz: float
    unit: str
    """Unit in which its number is taken; "": it is written there."""


def told_rate_hz(survey: Survey) -> float | None:
    """Return the rate [Hz] that a variable or a line of the file tells; None: none does."""
    found = told_rate(survey)
    return None if found is None else found.rate_hz


def check_stated(survey: Survey, rate_hz: float, option: str) -> None:
    """Raise InputError where all that a file states of the rate, in attributes or in a line, contradicts an option."""
    lines = survey.preamble
    stated = [
        StatedPeriod(one.period_s, one.period_key, is_of_device=one.is_decimated)
        for one in survey.numeric.values()
        if one.period_s
    ]
    if not stated and lines.period_s is not None:
        stated = [StatedPeriod(lines.period_s, f"by {lines.source}", lines.rounding, is_of_device=True)]
    stated = [one for one in stated if not one.is_default]
    if stated and not any(one.agrees(rate_hz) for one in stated):
        raise InputError(
            f"{option}: {survey.path} states {in_hz(1.0 / stated[0].period_s)} Hz "
            f"({stated[0].source}); correct one, the option or the file"
        )


def told_rate(survey: Survey) -> ToldRate | None:
    """Return the rate of a line above the columns, else of a variable."""
    lines = survey.preamble
    if lines.period_s is None:
        return rate_variable(survey)
    return ToldRate(lines.source, float(f"{1.0 / lines.period_s:.12g}"), lines.taken_in)


def rate_variable(survey: Survey) -> ToldRate | None:
    """Return the rate of a single number that is called as a rate or a period is."""
    for name, column in survey.columns.items():
        if column.values is None or column.rows != 1 or not column.values[0] > 0.0:
            continue
        if (told := _by_its_key(survey, name)) is not None:
            return told
        reading = read_column(Column(name=_last_part(name), unit=column.unit))
        value = float(column.values[0])
        if reading.votes.get("rate") or (reading.votes.get("none") and is_rate_unit(reading.unit.text)):
            unit = reading.unit.text or "Hz"
            return ToldRate(f'the variable "{name}"', convert_number(value, unit, "Hz"), unit)
        if reading.votes.get("period"):
            unit = reading.unit.text or "s"
            return ToldRate(f'the variable "{name}"', 1.0 / convert_number(value, unit, "s"), unit)
    return None


def _by_its_key(survey: Survey, name: str) -> ToldRate | None:
    """Return the rate of a variable whose name means one, with the unit that its name or another variable gives."""
    key, column = _last_part(name), survey.columns[name]
    value = f"{float(column.values[0]):.17g} {column.unit or ''}" if column.values is not None else ""
    around = {
        _last_part(other): str(one.raw.reshape(-1)[0])
        for other, one in survey.columns.items()
        if one.raw is not None
        and one.rows == 1
        and one.values is None
        and one.place.groups == column.place.groups
    }
    named = rate_key(key, periods=VARIABLES)
    found = None if named is None else stated_period({key: value, **around}, periods=VARIABLES)
    if found is None or named is None or found[1] != f'by "{key}"':
        return None
    unit = named.unit or column.unit or ("Hz" if named.is_rate else "s")
    return ToldRate(f'the variable "{name}"', float(f"{1.0 / found[0]:.12g}"), unit)


def _last_part(name: str) -> str:
    return name.rpartition(".")[2].rpartition("/")[2]


def one_of_several(told: ToldRate | None, rate_hz: float) -> tuple[str, ...]:
    """Return the remark that a file has one of several samples of the rate that it tells, where that is so."""
    if told is None:
        return ()
    every = decimation(StatedPeriod(1.0 / told.rate_hz, told.source, is_of_device=True), rate_hz)
    text = f"rate: {told.source} gives {told.rate_hz:.6g} Hz; by its time the file has one of {every} of those samples"
    return (text,) if every else ()


def describe_missing_rate(surveys: Sequence[Survey], rates: Sequence[ToldRate | None]) -> str:
    """Return what the first file without a rate states in place of one, and what another file states."""
    survey = surveys[rates.index(None)]
    doubt = survey.preamble.doubt
    if len(surveys) == 1:
        return doubt or "the file states no rate that can be read"
    text = (
        f"in {survey.path.name} {doubt}" if doubt else f"{survey.path.name} states no rate that can be read"
    )
    others = [(one, other.path.name) for one, other in zip(rates, surveys, strict=True) if one is not None]
    return text + "".join(f" ({one.source} of {name} gives {one.rate_hz:.6g} Hz)" for one, name in others[:1])


def is_rate_unit(unit: str) -> bool:
    """Return whether a unit is one of frequencies."""
    try:
        check_unit(unit, "Hz")
    except ValueError:
        return False
    return bool(unit)


def convert_number(value: float, unit: str, to: str) -> float:
    """Convert a number. Raises ValueError in words for an unknown or incompatible unit."""
    return float(convert_column(np.array([value]), unit, to)[0])
