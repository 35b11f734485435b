"""Instants in columns of numbers, one for hours, minutes and seconds each, perhaps of year, month and day too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_WORDS = {
    "year": ("year", "yyyy", "jahr"),
    "month": ("month", "mon", "monat"),
    "day": ("day", "tag", "dd"),
    "hour": ("hour", "hours", "hr", "hh", "h", "stunde", "std"),
    "minute": ("minute", "minutes", "min", "mi", "m"),
    "second": ("second", "seconds", "sec", "secs", "ss", "s", "sekunde"),
}
"""Names of the columns, in lower case."""
_LIMITS = {
    "year": (1970, 2200),
    "month": (1, 12),
    "day": (1, 31),
    "hour": (0, 23),
    "minute": (0, 59),
    "second": (0, 60),
}
_DATE, _CLOCK = ("year", "month", "day"), ("hour", "minute", "second")
_DAY_NS, _HALF = 86_400 * 10**9, 0.5


def clock_columns(names: Mapping[str, str]) -> dict[str, str]:
    """Return the columns of a clock by what they count, of columns by their names in lower case; {}: they are none."""
    found = {part: names[word] for part, words in _WORDS.items() for word in words if word in names}
    parts = [*(_DATE if all(one in found for one in _DATE) else ()), *_CLOCK]
    return {part: found[part] for part in parts} if all(one in found for one in _CLOCK) else {}


def are_clock(parts: Sequence[str], load: Callable[[str], Numbers | None]) -> bool:
    """Return whether the numbers of all parts are within their limits, and whole but for those of seconds."""
    for part in parts:
        values, (low, high) = load(part), _LIMITS[part]
        if values is None or not np.all((values >= low) & (values <= high)):
            return False
        if part != "second" and not np.all(values == np.round(values)):
            return False
    return True


def clock_ns(parts: Mapping[str, Numbers]) -> NDArray[np.int64]:
    """Return instants (n,) [ns] from an origin that they share, over midnight too where no date is told."""
    hours, minutes, seconds = (parts[one] for one in _CLOCK)
    of_day = np.rint(1e9 * seconds).astype(np.int64) + (3600 * hours + 60 * minutes).astype(np.int64) * 10**9
    if "year" not in parts:
        return of_day + _DAY_NS * np.cumsum(np.diff(of_day, prepend=of_day[:1]) < -_HALF * _DAY_NS)
    years, months, days = (parts[one].astype(np.int64) for one in _DATE)
    month = (12 * (years - 1970) + months - 1).astype("datetime64[M]")
    return of_day + _DAY_NS * (month.astype("datetime64[D]").astype(np.int64) + days - 1)
