"""What tells the instants of the samples: a time column and its unit, a rate that the files state, or the user."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.errors import InputError
from rtctl.measured.columns.time_axis import StatedPeriod, in_hz
from rtctl.measured.columns.time_column import TimeColumn
from rtctl.measured.proposal.candidates import is_count
from rtctl.measured.proposal.given import NONE, column_and_unit
from rtctl.measured.proposal.instants.column_time import AGREES, Time, checked_time_unit, of_column, read_time
from rtctl.measured.proposal.instants.no_time import describe_no_times
from rtctl.measured.proposal.instants.other_times import first_uneven_row, other_times
from rtctl.measured.proposal.instants.told_rate import (
    ToldRate,
    check_stated,
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
from rtctl.measured.stated_unit import time_unit_in_name
from rtctl.measured.units import count_s

_TRIED = ("s", "ms", "us", "ns", "min", "h", "d")
"""Units of a time column of which nobody states one."""
UNEVEN, MORE_EVEN = 0.01, 0.1
"""Spread of steps over the usual one from which another time is looked for, and how much less it must have."""
OUT_OF_ORDER = 0.1
"""Share of the steps that go back, up to which a column of times is one whose rows are out of order."""


Homes = frozenset[tuple[str, ...]]
"""Groups of columns, each with those around it, the outermost first."""


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
        return of_column(columns[name], unit, "you said so", told_rate(_without_others(surveys[0], homes)))
    near = [_without_others(survey, homes) for survey in surveys]
    found = _time_column(near[0]) if answers.time is None else None
    if found is not None and not _only_counts(found[0], told_rate(near[0])):
        return _beside_others(near[0], found[0], of_column(found[0], "", found[1], told_rate(near[0])))
    told = _of_files(near)
    return _of_others(surveys[0], answers, told, homes) if told.opens and homes else told


def _beside_others(survey: Survey, taken: Column, time: Time) -> Time:
    """Return the time with a question about another one that goes on otherwise, or a doubt about one that is late."""
    others = list(other_times(survey, taken))
    differing = [one.name for one in others if np.isnan(one.later_s)]
    if differing:
        names = ", ".join(f'"{name}"' for name in (taken.name, *differing))
        text = (
            f"the file has several times, {names}, which do not go on together: which one the signals have does not "
            "show. Where each signal has its own, export them with one time for all"
        )
        return time._replace(opens=(*time.opens, Open("time", text, f"--time {shlex.quote(taken.name)}")))
    doubts = []
    for one in others:
        order = "later" if one.later_s > 0.0 else "earlier"
        doubts.append(
            f'time: "{one.name}" is {abs(one.later_s):.6g} s {order} than "{taken.name}", which is taken for all '
            "signals: has a signal that other time?"
        )
    return time._replace(unsure=(*time.unsure, *doubts))


def _check_near(surveys: Sequence[Survey], rate_hz: float, option: str, homes: Homes) -> None:
    """Raise InputError where the files state another rate for the groups `homes` than an option gives."""
    for survey in surveys:
        if homes or not any(one.place.groups for one in survey.columns.values()):
            check_stated(_without_others(survey, homes), rate_hz, option)


def _rate_of(column: Column, unit: str) -> float:
    """Return the rate [Hz] of a column in a unit of time; 0.0 where it has no numbers that increase."""
    if column.values is None or column.rows < 2:
        return 0.0
    step_s = float(np.median(np.diff(column.values))) * count_s(checked_time_unit(unit))
    return 1.0 / step_s if step_s > 0.0 else 0.0


def _check_rate(survey: Survey, rate_hz: float, homes: Homes) -> None:
    """Raise InputError where the time of a file, or a variable of it, says another rate than the user."""
    if not homes and any(one.place.groups for one in survey.columns.values()):
        return  # whose time it is shows once the signals are known
    near = _without_others(survey, homes)
    check_stated(near, rate_hz, f"--sample-rate {rate_hz:g}")
    found = _time_column(near)
    if found is None:
        _check_increasing(near, rate_hz)
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
            stamps = read_time(column, one)
        except ValueError:
            return
        stamps_s = stamps.time_s
        steps = np.diff(stamps_s)
        usual_s = usual_s or float(np.median(steps))
        if any(
            abs(step * rate_hz - 1.0) < AGREES for step in (float(np.median(steps)), float(np.mean(steps)))
        ):
            _check_even(survey, column, stamps, rate_hz)
            return
    assumed = "" if stated or column.values is None else ", read in seconds,"
    raise InputError(
        f'--sample-rate {rate_hz:g}: the time column "{column.name}" of {survey.path}{assumed} goes on by '
        f"{usual_s:.6g} s, which is {1.0 / usual_s:.6g} Hz; {remedy}"
    )


def _check_increasing(survey: Survey, rate_hz: float) -> None:
    """Raise InputError where a column with the name and the unit of a time goes back: its rows are out of order."""
    for name, column in survey.columns.items():
        read = read_column(column)
        is_time = (
            read.votes.get("time", 0.0) >= WEAK and read.unit.text and quantity_of(read.unit.text) == "time"
        )
        if not is_time or column.values is None or column.rows != survey.rows:
            continue
        steps = np.diff(column.values)
        if 0.0 < float(np.mean(steps < 0.0)) < OUT_OF_ORDER:
            raise InputError(
                f'--sample-rate {rate_hz:g}: the time column "{name}" of {survey.path} goes back after row '
                f"{int(np.argmax(steps < 0.0))}, so its rows are out of order or of several records; correct the file, "
                "or say --time - to pass over it"
            )


def _check_even(survey: Survey, column: Column, stamps: TimeColumn, rate_hz: float) -> None:
    """Raise InputError where the time of a file leaves the even course of a rate that was said."""
    row = first_uneven_row(stamps.time_s, stamps.resolution_s, rate_hz)
    if row is not None:
        step_s = float(stamps.time_s[row + 1] - stamps.time_s[row])
        raise InputError(
            f'--sample-rate {rate_hz:g}: the time column "{column.name}" of {survey.path} does not go on evenly at '
            f"that rate: by {step_s:.6g} s after row {row}; leave out --sample-rate, or say --time - to pass over it"
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
        found = of_column(survey.columns[times[0]], "", "the only time in the file", None)
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
        return _most_even([one for vote, one in voted if vote == best]), "it increases, and its name says so"
    first = next((name for name, one in survey.columns.items() if one.raw is not None), "")
    if any(one.name == first and vote == 0.0 for vote, one in voted) and _is_nameless(survey, first):
        return survey.columns[first], "it is the first column, and increases in equal steps"
    return None


def _most_even(columns: Sequence[Column]) -> Column:
    """Return the first of several times, or one that is far more even: stamps of samples beside those of receipt."""
    first, *others = columns
    spreads = {one.name: _spread(one) for one in others}
    best = min(others, key=lambda one: spreads[one.name], default=first)
    return (
        best
        if others and spreads[best.name] < MORE_EVEN * _spread(first) and _spread(first) > UNEVEN
        else first
    )


def _spread(column: Column) -> float:
    """Return the spread of the steps of a time over the usual one; inf of dates."""
    if column.values is None:
        return np.inf
    steps = np.diff(column.values)
    return float(np.std(steps) / np.median(steps))


def _only_counts(column: Column, told: ToldRate | None) -> bool:
    """Return whether a column without a unit counts the rows of a file that tells their rate."""
    if told is None or column.values is None or not is_count(column.values):
        return False
    unit = read_column(column).unit.text or time_unit_in_name(column.name) or ""
    return not unit


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
        if StatedPeriod(period_s, key).is_default:
            return Time(
                guess, unsure=(f"rate: the file states {key} = 1 s, as programs do where nobody set it",)
            )
        return Time(guess)
    rates = [told_rate(survey) for survey in surveys]
    if all(rates):
        return _of_told([one for one in rates if one])
    times = describe_no_times(surveys[0]) or "no column looks like a time"
    text = f"the sample rate is not known: {times}, and {describe_missing_rate(surveys, rates)}"
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
