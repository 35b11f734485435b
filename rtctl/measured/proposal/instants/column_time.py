"""The time of a column, with its unit, or a question about that.

A time column of which nobody states the unit is taken in seconds only where that is the only sense it makes: as
milliseconds, a step below `FINEST_DOUBT_S` would mean more than 100 kHz.
"""

from __future__ import annotations

import shlex
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.measured.columns.time_column import TimeColumn, TimeUnit, seconds
from rtctl.measured.proposal.instants.told_rate import ToldRate, convert_number, one_of_several
from rtctl.measured.proposal.naming.column_units import own_scale, quantity_of, read_column
from rtctl.measured.proposal.proposal import Open, TimeGuess
from rtctl.measured.proposal.survey import Column
from rtctl.measured.stated_unit import time_unit_in_name
from rtctl.measured.units import count_s, is_clock, same_count

FINEST_DOUBT_S = 0.0101
"""Step [s] above which a column without a unit may as well count milliseconds: of 100 kHz and less."""
AGREES = 0.005
"""Relative difference of a step and a period below which they are the same."""
_EPOCHS = ((1e9, 1e10, "s"), (1e12, 1e13, "ms"), (1e15, 1e16, "us"), (1e18, 1e19, "ns"))
"""Sizes of instants between 2001 and 2286, counted since 1970, and their unit."""
_SLOWEST_S = 60.0
"""Step [s] of instants since 1970 from which they may as well be counts since power-up in a finer unit."""
_DAYS = ((40_000.0, 60_000.0, "a spreadsheet"), (730_000.0, 750_000.0, "MATLAB"))
"""Sizes of instants between 2009 and 2053, counted in days as these do."""
_FINEST_S = 1e-5
"""Step [s] below which a column of such a size counts days."""


_FEWEST_TICKS = 100.0
"""Whole step from which numbers may be ticks of a clock."""
_CLOCKS = (
    "UNIT is then the rate of the clock, such as 60 MHz; Zurich Instruments call it clockbase: 60 MHz in MFLI, 210 MHz "
    "in HF2LI, 1800 MHz in UHFLI"
)


class Time(NamedTuple):
    """The time of all files."""

    guess: TimeGuess
    opens: tuple[Open, ...] = ()
    unsure: tuple[str, ...] = ()


def epoch_unit(size: float) -> str | None:
    """Return the unit in which numbers that reach a size count since 1970; None: they are too small or too large."""
    return next((unit for low, high, unit in _EPOCHS if low <= size < high), None)


def read_time(column: Column, unit: str | None) -> TimeColumn:
    """Return the instants of a column [s]. Raises ValueError in words."""
    if column.raw is None:
        raise ValueError(f'column "{column.name}" {column.refusal}')
    return seconds(column.raw, TimeUnit(unit or "s", "manifest"), column.name, 0)


def of_column(column: Column, given_unit: str, why: str, told: ToldRate | None) -> Time:
    """Return the time of a column, with its unit or a question about it, which a rate in the file may settle."""
    if column.values is None:
        return Time(TimeGuess(column=column.name, why=f"{why}; dates"))
    if given_unit:
        guess = TimeGuess(column=column.name, unit=checked_time_unit(given_unit), why=why)
        return Time(guess, unsure=_other_time(column, given_unit, told))
    if column.unit is not None and is_clock(column.unit):
        return Time(TimeGuess(column=column.name, unit=column.unit, why=f"{why}; the file states its clock"))
    if scale := own_scale(column):
        text = (
            f'the time column "{column.name}" has the scale "{scale.text}" in its name: what its numbers count '
            "does not show"
        )
        return Time(TimeGuess(column=column.name, unit="s", why=why), opens=(_unit_question(column, text),))
    unit = read_column(column).unit
    if unit.text and quantity_of(unit.text) == "time":
        guess = TimeGuess(column=column.name, unit=unit.text, why=f"{why}; {unit.source}")
        if doubt := _may_be_days(column, unit.text):
            return Time(guess, unsure=(doubt,))
        step_s = float(np.median(np.diff(read_time(column, unit.text).time_s)))
        return Time(guess, unsure=one_of_several(told, 1.0 / step_s) if step_s > 0.0 else ())
    if unit.contradicts:
        text = f'the unit of the time column "{column.name}" is not clear: {unit.doubt}'
        return Time(TimeGuess(column=column.name, unit="s", why=why), opens=(_unit_question(column, text),))
    if named := time_unit_in_name(column.name):
        return Time(TimeGuess(column=column.name, unit=named, why=f"{why}; its name ends with {named}"))
    return _of_unknown_unit(column, why, told)


def _unit_question(column: Column, text: str) -> Open:
    return Open("time_unit", text, f"--time {shlex.quote(column.name + ':UNIT')} or --sample-rate HZ")


def _may_be_days(column: Column, unit: str) -> str:
    """Return the doubt about seconds whose size and steps are those of days since 1900 or year 0; "": there is none."""
    assert column.values is not None
    size, step = float(np.nanmax(np.abs(column.values))), float(np.median(np.diff(column.values)))
    for low, high, program in _DAYS:
        if unit == "s" and low <= size < high and step < _FINEST_S:
            return (
                f'time: "{column.name}" reaches {size:.9g} and goes on by {step:.4g}, as days of {program} do: in '
                f"seconds that is {1.0 / step:.6g} Hz, in days {1.0 / (86_400.0 * step):.6g} Hz; if it counts days, "
                f"say --time {shlex.quote(column.name + ':d')}"
            )
    return ""


def _other_time(column: Column, given_unit: str, told: ToldRate | None) -> tuple[str, ...]:
    """Return the doubt about a unit of time that the user gave where the column or the file says another one."""
    assert column.values is not None
    step = float(np.median(np.diff(column.values))) if column.rows > 1 else 0.0
    if not step > 0.0:
        return ()
    step_s, read = step * count_s(given_unit), read_column(column).unit
    if read.text and quantity_of(read.text) == "time":
        against = "" if same_count(read.text, given_unit) else read.source
    elif told is not None:
        several = one_of_several(told, 1.0 / step_s)
        if several or abs(step_s * told.rate_hz - 1.0) < AGREES:
            return several
        against = f"{told.source} of the file gives {told.rate_hz:.6g} Hz"
    else:
        against = f"in seconds it gives {1.0 / step:.6g} Hz" if step_s < _FINEST_S <= step else ""
    if not against:
        return ()
    rate = f"{1.0 / step_s:.6g} Hz over {step_s * (column.rows - 1):.6g} s"
    return (f'time: "{column.name}" is read in {given_unit}, as you said: {rate}, but {against}',)


def _of_unknown_unit(column: Column, why: str, told: ToldRate | None) -> Time:
    assert column.values is not None
    size = float(np.nanmax(np.abs(column.values)))
    if (epoch := epoch_unit(size)) is not None:
        step_s = convert_number(float(np.median(np.diff(column.values))), epoch, "s")
        if step_s >= _SLOWEST_S:
            text = (
                f'the time column "{column.name}" reaches {size:.6g}: in {epoch} since 1970 its steps are '
                f"{step_s:.6g} s; counts of a clock since it was switched on are in a finer unit"
            )
            return Time(
                TimeGuess(column=column.name, unit=epoch, why=why), opens=(_unit_question(column, text),)
            )
        guess = TimeGuess(column=column.name, unit=epoch, why=f"{why}; it counts since 1970, in {epoch}")
        return Time(guess, unsure=(f'time: "{column.name}" counts {epoch} since 1970, by its size',))
    step = float(np.median(np.diff(column.values)))
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if told is not None and abs(step * size * told.rate_hz - 1.0) < AGREES:
            because = f"{why}; {told.source} of the file gives {told.rate_hz:.6g} Hz, which makes it {unit}"
            return Time(TimeGuess(column=column.name, unit=unit, why=because))
    for low, high, program in _DAYS:
        if low <= float(np.nanmax(np.abs(column.values))) < high and step < _FINEST_S:
            text = (
                f'the time column "{column.name}" reaches {column.values[-1]:.9g} and goes on by {step:.4g}, as '
                f"days of {program} do (in days that is {1.0 / (86_400.0 * step):.6g} Hz)"
            )
            return Time(
                TimeGuess(column=column.name, unit="d", why=why),
                opens=(Open("time_unit", text, f"--time {shlex.quote(column.name + ':d')}"),),
            )
    guess = TimeGuess(
        column=column.name, unit="s", why=f"{why}; nobody states its unit, seconds give {1 / step:.6g} Hz"
    )
    if 1e-7 < step <= FINEST_DOUBT_S and told is None:
        hint = f"{1.0 / step:.6g} Hz over {step * (column.rows - 1):.6g} s"
        return Time(
            guess, unsure=(f'time: nobody states the unit of "{column.name}"; in seconds it gives {hint}',)
        )
    contradicted = "" if told is None else f" ({told.source} of the file gives {told.rate_hz:.6g} Hz)"
    if step >= _FEWEST_TICKS and step == round(step):
        contradicted = f", as ticks of a clock of 60 MHz {6e7 / step:.6g} Hz ({_CLOCKS}){contradicted}"
    text = (
        f'nobody states the unit of the time column "{column.name}", which goes on by {step:.6g}: in seconds that is '
        f"{1.0 / step:.6g} Hz, in ms {1e3 / step:.6g} Hz{contradicted}"
    )
    return Time(guess, opens=(_unit_question(column, text),))


def checked_time_unit(text: str) -> str:
    """Return a unit of time that the user gave. Raises InputError where it is none."""
    try:
        count_s(text)
    except ValueError as error:
        raise InputError(f"--time: {error}") from None
    return text
