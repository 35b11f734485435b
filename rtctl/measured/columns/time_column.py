"""Convert a time column to seconds: numbers in any unit of time, epochs, dates, times of day."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.measured.columns.conversion import check_finite, numbers, rows_text
from rtctl.measured.stated_unit import readable, time_unit_in_name, time_unit_of
from rtctl.measured.units import count_s, is_clock, same_count

SLOW_S, FAST_S = 1.0, 1e-7
"""Periods [s] beyond which seconds that nobody stated are remarked upon."""
_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))
"""Sizes from which a number is an instant since 1970 in this unit; in a larger one it would be past the year 5000."""
_LARGE, _EXACT = 1e8, 2.0**53
"""Sizes from which stamps are counted from the first one, and from which floating point does not hold integers."""
_CLOCK = re.compile(r"\s*(\d{1,2}):(\d{2}):(\d{2}(?:[.,:]\d+)?)\s*(?:([AP])\.?M\.?)?\s*$", re.IGNORECASE)
"""Time of day; loggers also write its thousandths after a colon, and hours to 12 with AM or PM."""
_HAS_CLOCK = re.compile(r"\d:\d{2}")
_DATE = re.compile(
    r"\s*(?P<left>\d{1,4})(?P<sign>[-./])(?P<middle>\d{1,2})(?P=sign)(?P<right>\d{1,4})[T ]\s*"
    r"(?P<clock>\d{1,2}:\d{2}:\d{2}(?:[.,:]\d+)?(?:\s*[AP]\.?M\.?)?)\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?\s*$",
    re.IGNORECASE,
)
_MONTH = re.compile(r"\s*(\d{1,2})[-. ]+([^\W\d_]{3,9})[-. ]+(\d{4})\b")
"""A date with the name of its month: `21-Nov-2026`, `21. Okt 2026`."""
_MONTH_NAMES = (
    "jan", "feb fév", "mar mär mrz", "apr avr", "may mai", "jun juin", "jul juil", "aug aoû", "sep", "oct okt", "nov",
    "dec dez déc",
)  # fmt: skip
"""Beginnings of the names of months in English, German and French."""
_PASSED = re.compile(r"\s*(\d+) days? (?=\d{2}:\d{2}:\d{2})")
"""Days in front of hours, as pandas writes what has passed."""
_MINUTES = re.compile(r"\s*(\d{1,3}):([0-5]\d[.,]\d+)\s*$")
"""Minutes and seconds: without a fraction they might be hours and minutes."""
_DAY_S = 86_400.0
_MONTHS, _HALF_DAY_H = 12, 12
_YEAR_DIGITS, _CENTURY = 4, "20"
_COARSEST_POWER, _FINEST_POWER = 3, -13


class UnclearInstantError(ValueError):
    """A text among dates that is none, or a date that may be several; the message says what to write."""


class TimeUnit(NamedTuple):
    """Unit of a time column, and who says so."""

    unit: str
    source: str
    """Source: "manifest" | "file" | "name" | "" (nobody: seconds)."""


class TimeColumn(NamedTuple):
    """A time column in seconds."""

    time_s: FloatArray
    """Seconds (n,), those of epochs and dates since the first row."""
    resolution_s: float
    """Step [s] to which the stamps are rounded."""
    of_dates: bool = False
    """Whether they are dates or times of day, whose unit nobody has to state."""


def choose_time_unit(manifest: str | None, stated: str | None, name: str) -> TimeUnit:
    """Return the unit of a time column.

    Args:
        manifest: The record's `time_unit`.
        stated: Text that the file states as the column's unit, if any.
        name: Name of the column, which may end with a unit (`t_ms`).

    Raises:
        ValueError: The file states another unit than the manifest, or one that is no unit of time.
    """
    in_file = None if stated is None or not readable(time_unit_of(stated)) else time_unit_of(stated)
    if stated is not None and is_clock(stated):
        in_file = stated
    if in_file is not None:
        try:
            count_s(in_file)
        except ValueError:
            raise ValueError(
                f'the file states unit "{stated}" for column "{name}", which is no time'
            ) from None
    if manifest is not None:
        if in_file is not None and not same_count(in_file, manifest):
            raise ValueError(
                f'the file states unit "{stated}" for column "{name}", the manifest time_unit = "{manifest}"; '
                "correct one"
            )
        return TimeUnit(manifest, "manifest")
    if in_file is not None:
        return TimeUnit(in_file, "file")
    named = time_unit_in_name(name)
    return TimeUnit("s", "") if named is None else TimeUnit(named, "name")


def seconds(raw: NDArray[Any], unit: TimeUnit, name: str, first_row: int) -> TimeColumn:
    """Return a raw time column in seconds; epochs and dates are counted from its first row. Raises ValueError in words.

    Integers and dates are subtracted before they become floating-point numbers, which do not hold nanoseconds since
    1970.
    """
    raw = raw.reshape(-1) if raw.size == max(raw.shape, default=0) else raw
    if raw.dtype.kind in "OSU":
        raw = _instants_of_text(raw, name, first_row)
    if raw.dtype.kind in "Mm":
        return _of_dates(raw, name, first_row)
    values = numbers(raw, name, first_row)
    check_finite(values, name, first_row)
    size = float(np.abs(values).max(initial=0.0))
    _check_size(size, unit, name)
    if raw.dtype.kind in "iu" and size > _EXACT:
        values = (raw - raw[0]).astype(np.int64).astype(np.float64)  # differences wrap around rightly
        return _scaled(values, 1.0, unit.unit)
    resolution = max(decimal_step(values), float(np.spacing(size)), _single_step(values, size))
    return _scaled(values if size < _LARGE else values - values[0], resolution, unit.unit)


def _single_step(values: FloatArray, size: float) -> float:
    """Return the step of single precision at `size`, if all `values` (n,) have no more; 0.0: they have."""
    single = values.astype(np.float32).astype(np.float64)
    digits = max(0.5 * decimal_step(values), float(np.spacing(size)))
    return float(np.spacing(np.float32(size))) if np.all(np.abs(values - single) <= digits) else 0.0


def decimal_step(values: FloatArray) -> float:
    """Return the largest power of ten of which all `values` (n,) are multiples, to rounding; 0.0: there is none."""
    size = float(np.abs(values).max(initial=0.0))
    for power in range(_COARSEST_POWER, _FINEST_POWER - 1, -1):
        step = 10.0**power
        parts = values / step
        if np.all(np.abs(parts - np.rint(parts)) < 1e-6 + 4.0 * np.spacing(size) / step):
            return step
        if 4.0 * np.spacing(size) > 0.1 * step:
            break  # finer steps are not held by these numbers
    return 0.0


def remark_on_period(period_s: float, duration_s: float, unit: TimeUnit, name: str) -> str:
    """Return a remark where seconds that nobody stated give an unusual rate, or a name alone gave the unit; else ""."""
    if unit.source == "name":
        return f'time column "{name}" is read in {unit.unit}, which its name ends with'
    named = time_unit_in_name(name) if unit.source == "manifest" else None
    if named is not None and not same_count(named, unit.unit):
        return (
            f'time column "{name}" is read in {unit.unit}, as time_unit says, though its name ends with {named}: '
            f"correct time_unit if that is a slip ({1.0 / period_s:.6g} Hz over {duration_s:.6g} s)"
        )
    if unit.source or FAST_S < period_s < SLOW_S:
        return ""
    return (
        f'time column "{name}" is taken in seconds, as nothing says otherwise: {1.0 / period_s:.6g} Hz over '
        f'{duration_s:.6g} s. If it counts something else, say time_unit = "ms" (or "us", "min", "d"); if not, "s"'
    )


def _check_size(size: float, unit: TimeUnit, name: str) -> None:
    if unit.source == "manifest" or unit.unit not in ("s", "sec", "second"):
        return
    for least, meant in _EPOCHS:
        if size >= least:
            raise ValueError(
                f'time column "{name}" reaches {size:.6g}, as {meant} since 1970 would, but is read in seconds; '
                f'say time_unit = "{meant}"'
            )


def _scaled(values: FloatArray, resolution: float, unit: str) -> TimeColumn:
    factor = count_s(unit)
    return TimeColumn(np.ascontiguousarray(factor * values), factor * resolution)


def _of_dates(dates: NDArray[Any], name: str, first_row: int) -> TimeColumn:
    missing = np.flatnonzero(np.isnat(dates))
    if len(missing):
        raise ValueError(f'column "{name}" has no date in {rows_text(missing + first_row)}')
    if not len(dates):
        return TimeColumn(np.empty(0), 0.0)
    tick = np.array(1, dtype=f"timedelta64[{np.datetime_data(dates.dtype)[0]}]")
    ticks = (dates - dates[0]) / tick
    tick_s = float(tick / np.timedelta64(1, "s"))
    resolution_s = tick_s * max(decimal_step(ticks), 1.0)
    return TimeColumn(np.ascontiguousarray(ticks * tick_s), resolution_s, of_dates=True)


def _as_iso(words: list[str]) -> list[str]:
    """Return dates with points, slashes and decimal commas as ISO 8601 has them; texts of other forms stay.

    Of 03/04/2026 nobody knows the month, unless some row has a number above 12; where the date is the same throughout,
    it does not matter.
    """
    found = [_DATE.match(word) for word in words]
    dates = {(one["left"], one["middle"], one["right"]) for one in found if one}
    if not words or not all(found) or not dates:
        return words
    of_four = [len(left) == _YEAR_DIGITS or len(right) == _YEAR_DIGITS for left, _, right in dates]
    if not all(of_four) and not all(one and one["sign"] == "." for one in found):
        order = "any" if len(dates) == 1 else ""  # 26/11/21: nobody knows the year
    elif all(len(left) == _YEAR_DIGITS for left, _, _ in dates):
        order = "year"
    elif all(one and one["sign"] == "." for one in found) or any(int(left) > _MONTHS for left, _, _ in dates):
        order = "day"
    elif any(int(middle) > _MONTHS for _, middle, _ in dates):
        order = "month"
    elif len(dates) == 1:
        order = "any"
    else:
        order = ""
    return [_iso(one, order) for one in found if one] if order else words


def _iso(found: re.Match[str], order: str) -> str:
    """Return a date whose first part is the `order`; of "any" only the time of day counts."""
    left, middle, right = found["left"], found["middle"], found["right"]
    right = _CENTURY + right if order == "day" and len(right) < _YEAR_DIGITS else right
    dates = {
        "year": f"{left}-{middle:0>2}-{right:0>2}",
        "day": f"{right}-{middle:0>2}-{left:0>2}",
        "month": f"{right}-{left:0>2}-{middle:0>2}",
        "any": "2000-01-01",
    }
    hours, minutes, seconds_text = _time_of_day(found["clock"])
    zone = (found["zone"] or "").upper()
    zone = "Z" if zone in ("UTC", "GMT") else zone
    return f"{dates[order]}T{hours:02d}:{minutes:02d}:{seconds_text}{zone}"


def _with_number_of_month(word: str) -> str:
    """Return a date with the name of its month as `21.11.2026`; another text as it is."""
    found = _MONTH.match(word)
    if found is None:
        return word
    name = found[2].lower()
    number = next(
        (k for k, known in enumerate(_MONTH_NAMES, 1) if any(name.startswith(one) for one in known.split())),
        0,
    )
    return f"{found[1]}.{number}.{found[3]}{word[found.end() :]}" if number else word


def _time_of_day(clock: str) -> tuple[int, int, str]:
    """Return hours, minutes and the text of the seconds of a time that `_CLOCK` matches."""
    found = _CLOCK.match(clock)
    assert found is not None
    hours = int(found[1])
    if found[4]:
        hours = hours % _HALF_DAY_H + (_HALF_DAY_H if found[4].upper() == "P" else 0)
    return hours, int(found[2]), re.sub("[,:]", ".", found[3])


def _passed_s(words: list[str]) -> FloatArray | None:
    """Return times that have passed [s]: minutes and seconds, or days and hours; None: the words are others."""
    form = next((one for one in (_MINUTES, _PASSED) if words and one.match(words[0])), None)
    found = [form.match(word) for word in words] if form else []
    if form is None or not all(found):
        return None
    if form is _MINUTES:
        return np.array([60.0 * int(one[1]) + float(one[2].replace(",", ".")) for one in found if one])
    clocks = [_time_of_day(_PASSED.sub("", word)) for word in words]
    days = [int(one[1]) for one in found if one]
    return np.array(
        [_DAY_S * d + 3600 * h + 60 * m + float(s) for d, (h, m, s) in zip(days, clocks, strict=True)]
    )


def _instants_of_text(texts: NDArray[Any], name: str, first_row: int) -> NDArray[Any]:
    """Return dates (ISO 8601) as datetime64[ns], or times of day as timedelta64[ns]. Raises ValueError in words."""
    words = [str(text.decode("latin-1") if isinstance(text, bytes) else text) for text in texts.reshape(-1)]
    if words and _MONTH.match(words[0]):
        words = [_with_number_of_month(word) for word in words]
    words = _as_iso(words)
    if (passed_s := _passed_s(words)) is not None:
        return np.rint(1e9 * passed_s).astype("timedelta64[ns]")
    if words and all(_CLOCK.match(word) for word in words):
        clock = [_time_of_day(word) for word in words]
        of_day = np.array([3600 * hours + 60 * minutes + float(rest) for hours, minutes, rest in clock])
        of_day += _DAY_S * np.cumsum(np.diff(of_day, prepend=of_day[0]) < -0.5 * _DAY_S)  # over midnight
        return np.rint(1e9 * of_day).astype("timedelta64[ns]")
    for kind in (pa.timestamp("ns"), pa.timestamp("ns", tz="UTC")):
        try:
            return np.asarray(
                pa.array([word.strip() for word in words]).cast(kind).to_numpy(zero_copy_only=False)
            )
        except pa.ArrowInvalid:
            continue
    empty = np.asarray([row for row, word in enumerate(words) if not _HAS_CLOCK.search(word)], dtype=np.intp)
    if 0 < len(empty) < len(words):
        raise UnclearInstantError(
            f'column "{name}" has no date or time of day in {rows_text(empty + first_row)}, '
            f'"{words[empty[0]].strip()}": write it there, or remove the row'
        )
    if words and all(one is not None and len(one["left"]) < _YEAR_DIGITS for one in map(_DATE.match, words)):
        raise UnclearInstantError(
            f'column "{name}" may have the day or the month first, or a year of two digits, in "{words[0].strip()}": '
            "write its dates as 2026-11-21"
        )
    try:
        numbers(np.asarray(words), name, first_row)
    except ValueError as error:
        raise ValueError(f"{error}. Dates are read as 2026-11-21T10:00:00.001") from None
    raise ValueError(f'column "{name}" holds no dates')
