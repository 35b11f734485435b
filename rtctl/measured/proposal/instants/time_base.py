"""What tells the instants of the samples: a time column and its unit, a rate that the files state, or the user.

A time column of which nobody states the unit is taken in seconds only where that is the only sense it makes: as
milliseconds, a step below `FINEST_DOUBT_S` would mean more than 100 kHz.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.measured.columns.time_axis import StatedPeriod, in_hz
from rtctl.measured.columns.time_column import TimeColumn, TimeUnit, seconds
from rtctl.measured.proposal.candidates import is_count
from rtctl.measured.proposal.given import NONE, column_and_unit
from rtctl.measured.proposal.instants.told_rate import (
    ToldRate,
    check_stated,
    convert_number,
    describe_missing_rate,
    is_rate_unit,
    one_of_several,
    rate_variable,
    told_rate,
)
from rtctl.measured.proposal.naming.column_names import WEAK
from rtctl.measured.proposal.naming.column_units import quantity_of, read_column
from rtctl.measured.proposal.proposal import Answers, Open, TimeGuess
from rtctl.measured.proposal.survey import Column, Survey
from rtctl.measured.units import check_unit, same_unit

FINEST_DOUBT_S = 0.0101
"""Step [s] above which a column without a unit may as well count milliseconds: of 100 kHz and less."""
AGREES = 0.005
"""Relative difference of a step and a period below which they are the same."""
_EPOCHS = ((1e9, 1e10, "s"), (1e12, 1e13, "ms"), (1e15, 1e16, "us"), (1e18, 1e19, "ns"))
"""Sizes of instants between 2001 and 2286, counted since 1970, and their unit."""
_DAYS = ((40_000.0, 60_000.0, "a spreadsheet"), (730_000.0, 750_000.0, "MATLAB"))
"""Sizes of instants between 2009 and 2053, counted in days as these do."""
_TRIED = ("s", "ms", "us", "ns", "min", "h", "d")
"""Units of a time column of which nobody states one."""
_FINEST_S = 1e-5
"""Step [s] below which a column of such a size counts days."""
_DEFAULT_PERIODS = (1.0,)
"""Periods [s] that programs write where nobody set one."""


Homes = frozenset[tuple[str, ...]]
"""Groups of columns, each with those around it, the outermost first."""


class Time(NamedTuple):
    """The time of all files."""

    guess: TimeGuess
    opens: tuple[Open, ...] = ()
    unsure: tuple[str, ...] = ()


def find_time(surveys: Sequence[Survey], answers: Answers, homes: Homes = frozenset()) -> Time:
    """Return what tells the time. Raises InputError where the user's word contradicts the files.

    Args:
        surveys: The files.
        answers: What the user said.
        homes: Groups of the signals in their file; a time or a rate of another group is not theirs. Empty: not known.
    """
    if answers.sample_rate_hz is not None:
        if answers.time is None:
            for survey in surveys:
                _check_rate(survey, answers.sample_rate_hz, homes)
        else:
            _check_near(surveys, answers.sample_rate_hz, f"--sample-rate {answers.sample_rate_hz:g}", homes)
        lines = told_rate(_without_others(surveys[0], homes))
        remark = one_of_several(lines, answers.sample_rate_hz)
        return Time(TimeGuess(rate_hz=answers.sample_rate_hz, why="you said so"), unsure=remark)
    columns = surveys[0].columns
    if answers.time not in (None, NONE):
        name, unit = column_and_unit(str(answers.time), columns, "--time")
        if unit and (rate_hz := _rate_of(columns[name], unit)) > 0.0:
            _check_near(surveys, rate_hz, f"--time {answers.time}, which gives {in_hz(rate_hz)} Hz", homes)
        return _of_column(columns[name], unit, "you said so", told_rate(_without_others(surveys[0], homes)))
    near = [_without_others(survey, homes) for survey in surveys]
    if answers.time is None and (found := _time_column(near[0])) is not None:
        return _of_column(found[0], "", found[1], told_rate(near[0]))
    told = _of_files(near)
    return _of_others(surveys[0], answers, told, homes) if told.opens and homes else told


def _check_near(surveys: Sequence[Survey], rate_hz: float, option: str, homes: Homes) -> None:
    """Raise InputError where the files state another rate for the groups `homes` than an option gives."""
    for survey in surveys:
        if homes or not any(one.place.groups for one in survey.columns.values()):
            check_stated(_without_others(survey, homes), rate_hz, option)


def _rate_of(column: Column, unit: str) -> float:
    """Return the rate [Hz] of a column in a unit of time; 0.0 where it has no numbers that increase."""
    if column.values is None or column.rows < 2:
        return 0.0
    step_s = convert_number(float(np.median(np.diff(column.values))), _time_unit(unit), "s")
    return 1.0 / step_s if step_s > 0.0 else 0.0


def _check_rate(survey: Survey, rate_hz: float, homes: Homes) -> None:
    """Raise InputError where the time of a file, or a variable of it, says another rate than the user."""
    if not homes and any(one.place.groups for one in survey.columns.values()):
        return  # whose time it is shows once the signals are known
    near = _without_others(survey, homes)
    check_stated(near, rate_hz, f"--sample-rate {rate_hz:g}")
    found = _time_column(near)
    remedy = "leave out --sample-rate, or say --time - to pass over it"
    if found is None:
        told = rate_variable(near)
        if told is not None and abs(told.rate_hz / rate_hz - 1.0) > AGREES:
            raise InputError(
                f"--sample-rate {rate_hz:g}: {told.source} of {survey.path} gives {told.rate_hz:.6g} Hz; {remedy}"
            )
        return
    column = found[0]
    if column.values is not None and is_count(column.values):
        return
    unit = read_column(column).unit
    stated = unit.text if unit.text and quantity_of(unit.text) == "time" else None
    usual_s = 0.0
    for one in [stated] if stated or column.values is None else _TRIED:
        try:
            stamps_s = read_time(column, one).time_s
        except ValueError:
            return
        steps = np.diff(stamps_s)
        usual_s = usual_s or float(np.median(steps))
        if any(
            abs(step * rate_hz - 1.0) < AGREES for step in (float(np.median(steps)), float(np.mean(steps)))
        ):
            return
    assumed = "" if stated or column.values is None else ", read in seconds,"
    raise InputError(
        f'--sample-rate {rate_hz:g}: the time column "{column.name}" of {survey.path}{assumed} goes on by '
        f"{usual_s:.6g} s, which is {1.0 / usual_s:.6g} Hz; {remedy}"
    )


def homes_of(survey: Survey, columns: Iterable[str]) -> Homes:
    """Return the groups that columns of a file are in, each with those around it; empty where the file has none."""
    if not any(one.place.groups for one in survey.columns.values()):
        return frozenset()
    return frozenset(survey.columns[name].place.groups for name in columns if name in survey.columns)


def is_near(column: Column, homes: Homes) -> bool:
    """Return whether a column is in the groups `homes`, or above them: it may tell their time."""
    return all(column.place.serves(home) for home in homes)


def _without_others(survey: Survey, homes: Homes) -> Survey:
    """Return a file without the times and rates of groups that are not those of the signals."""
    kept = {name: one for name, one in survey.columns.items() if is_near(one, homes)}
    if homes and not any(_increases(one, survey.rows) for one in kept.values()):
        kept |= _shared_times(survey, homes) or _with_shared_period(survey, homes)
    return replace(survey, columns=kept) if homes else survey


def _shared_times(survey: Survey, homes: Homes) -> dict[str, Column]:
    """Return one time of each of the signals' groups, where these are the same numbers; else nothing."""
    own = [
        [one for one in survey.columns.values() if one.place.groups == home and _increases(one, survey.rows)]
        for home in homes
    ]
    if not all(own):
        return {}
    first, *rest = (times[0] for times in own)
    instants = [np.asarray(one.raw) for one in (first, *rest)]
    return {first.name: first} if all(np.array_equal(instants[0], one) for one in instants) else {}


def _with_shared_period(survey: Survey, homes: Homes) -> dict[str, Column]:
    """Return the columns of the signals' groups that state their period, where all groups state the same one."""
    found = {
        name: one
        for name, one in survey.columns.items()
        if one.place.groups in homes and one.period_s is not None
    }
    is_one = len({one.period_s for one in found.values()}) == 1
    return found if is_one and {one.place.groups for one in found.values()} == homes else {}


def _of_others(survey: Survey, answers: Answers, told: Time, homes: Homes) -> Time:
    """Return the time of another group where the file has but one, with a doubt; else the question which one it is."""
    times = [] if answers.time == NONE else [
        name
        for name in time_candidates(survey)
        if max(read_column(survey.columns[name]).votes.get(one, 0.0) for one in ("time", "period")) >= WEAK
    ]  # fmt: skip
    names = ", ".join(f'"{name}"' for name in times)
    where = " and ".join(f'"{home[-1]}"' if home else "no group" for home in sorted(homes))
    if len(times) == 1:
        found = _of_column(survey.columns[times[0]], "", "the only time in the file", None)
        doubt = f"time: column {names} is of another group than the signals, which are in {where}: there is no other"
        return found._replace(unsure=(*found.unsure, doubt))
    if times:
        text = (
            f"the time of the signals, which are in {where}, is not known: the columns {names} are of other groups, "
            "and may have other rates"
        )
        options = f"--time {shlex.quote(times[0])} or --sample-rate HZ"
        return told._replace(opens=(Open("time", text, options), *told.opens[1:]))
    return told


def read_time(column: Column, unit: str | None) -> TimeColumn:
    """Return the instants of a column [s]. Raises ValueError in words."""
    if column.raw is None:
        raise ValueError(f'column "{column.name}" {column.refusal}')
    return seconds(column.raw, TimeUnit(unit or "s", "manifest"), column.name, 0)


def time_candidates(survey: Survey) -> list[str]:
    """Return the columns that may be the time: dates, or numbers that increase throughout."""
    return [name for name, column in survey.columns.items() if _increases(column, survey.rows)]


def _time_column(survey: Survey) -> tuple[Column, str] | None:
    """Return the column of the time, and why; None: no column looks like one."""
    voted = []
    for name in time_candidates(survey):
        column = survey.columns[name]
        votes = read_column(column).votes
        vote = max(votes.get("time", 0.0), votes.get("period", 0.0)) + (
            10.0 if column.values is None else 0.0
        )
        voted.append((vote, column))
    best = max((vote for vote, _ in voted), default=0.0)
    if best >= WEAK:
        return next(one for vote, one in voted if vote == best), "it increases, and its name says so"
    first = next((name for name, one in survey.columns.items() if one.raw is not None), "")
    if any(one.name == first and vote == 0.0 for vote, one in voted) and _is_nameless(survey, first):
        return survey.columns[first], "it is the first column, and increases in equal steps"
    return None


def _is_nameless(survey: Survey, first: str) -> bool:
    """Return whether the first column says nothing by its name or unit, and increases in equal steps."""
    column = survey.columns[first]
    reading = read_column(column)
    if reading.votes or reading.unit.text or column.values is None:
        return False
    steps = np.diff(column.values)
    return bool(np.ptp(steps) <= 1e-3 * abs(float(np.median(steps))))


def _increases(column: Column, rows: int) -> bool:
    if column.rows != rows or rows < 2:
        return False
    if column.values is not None:
        return bool(np.all(np.diff(column.values) > 0.0))
    try:
        return bool(np.all(np.diff(read_time(column, None).time_s) > 0.0))
    except ValueError:
        return False


def _of_column(column: Column, given_unit: str, why: str, told: ToldRate | None) -> Time:
    """Return the time of a column, with its unit or a question about it, which a rate in the file may settle."""
    if column.values is None:
        return Time(TimeGuess(column=column.name, why=f"{why}; dates"))
    if given_unit:
        guess = TimeGuess(column=column.name, unit=_time_unit(given_unit), why=why)
        return Time(guess, unsure=_other_time(column, given_unit, told))
    unit = read_column(column).unit
    if unit.text and quantity_of(unit.text) == "time":
        guess = TimeGuess(column=column.name, unit=unit.text, why=f"{why}; {unit.source}")
        step_s = float(np.median(np.diff(read_time(column, unit.text).time_s)))
        return Time(guess, unsure=one_of_several(told, 1.0 / step_s) if step_s > 0.0 else ())
    return _of_unknown_unit(column, why, told)


def _other_time(column: Column, given_unit: str, told: ToldRate | None) -> tuple[str, ...]:
    """Return the doubt about a unit of time that the user gave where the column or the file says another one."""
    assert column.values is not None
    step = float(np.median(np.diff(column.values))) if column.rows > 1 else 0.0
    if not step > 0.0:
        return ()
    step_s, read = convert_number(step, given_unit, "s"), read_column(column).unit
    if read.text and quantity_of(read.text) == "time":
        against = "" if same_unit(read.text, given_unit) else read.source
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
    for low, high, epoch in _EPOCHS:
        if low <= size < high:
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
    text = (
        f'nobody states the unit of the time column "{column.name}", which goes on by {step:.6g}: in seconds that is '
        f"{1.0 / step:.6g} Hz, in ms {1e3 / step:.6g} Hz{contradicted}"
    )
    return Time(
        guess,
        opens=(Open("time_unit", text, f"--time {shlex.quote(column.name + ':UNIT')} or --sample-rate HZ"),),
    )


def _time_unit(text: str) -> str:
    try:
        check_unit(text, "s")
    except ValueError as error:
        raise InputError(f"--time: {error}") from None
    return text


def _of_files(surveys: Sequence[Survey]) -> Time:
    """Return the rate that the files state in their columns or in a variable, or a question."""
    stated = {
        one.period_s: one.period_key for survey in surveys for one in survey.numeric.values() if one.period_s
    }
    if stated:
        period_s, key = next(iter(stated.items()))
        guess = TimeGuess(
            stated_hz=1.0 / period_s,
            why=f"the file states {in_hz(1.0 / period_s)} Hz ({StatedPeriod(period_s, key).source})",
        )
        if period_s in _DEFAULT_PERIODS:
            return Time(
                guess, unsure=(f"rate: the file states {key} = 1 s, as programs do where nobody set it",)
            )
        return Time(guess)
    rates = [told_rate(survey) for survey in surveys]
    if all(rates):
        return _of_told([one for one in rates if one])
    text = f"the sample rate is not known: no column looks like a time, and {describe_missing_rate(surveys, rates)}"
    spectra = [
        name for name in time_candidates(surveys[0]) if is_rate_unit(_unit_text(surveys[0].columns[name]))
    ]
    if spectra:
        text += f' (the column "{spectra[0]}" is a frequency: a spectrum is no record, its time signals are needed)'
    return Time(
        TimeGuess(), opens=(Open("sample_rate_hz", text, "--sample-rate HZ or --time COLUMN[:UNIT]"),)
    )


def _of_told(rates: Sequence[ToldRate]) -> Time:
    """Return the rate of a variable such as `fs`, or of a line; files of different rates have it each."""
    source, rate_hz, unit = rates[0]
    equal = all(abs(one.rate_hz / rate_hz - 1.0) < 1e-6 for one in rates)
    where = "file" if equal else "first file, the others state theirs"
    why = f"{source} of the {where}{f', taken in {unit}' if unit else ''}"
    unsure = (f"rate: {rate_hz:.6g} Hz by {why}",)
    return Time(TimeGuess(rate_hz=rate_hz if equal else None, why=why), unsure=unsure)


def _unit_text(column: Column) -> str:
    return read_column(column).unit.text
