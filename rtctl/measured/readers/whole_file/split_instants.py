"""Instants that a file has in several columns, joined to one: `Date + Time + ms`, `stamp.secs + stamp.nsecs`.

Loggers write the date, the time of day and its thousandths apart, ROS whole seconds and the nanoseconds beyond them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.measured.readers.groups import Place
from rtctl.measured.readers.stated.attributes import text_of
from rtctl.measured.readers.table import Column, Header, Table
from rtctl.measured.readers.whole_file.clock_columns import are_clock, clock_columns, clock_ns

_DATE = re.compile(r"date|datum|fecha|data|dato|day|tag|jour", re.IGNORECASE)
_CLOCK = re.compile(
    r"(?:date|time|datum|zeit|uhr)*(?:stamp)?|uhrzeit|heure|hora|ora|clock|zeitstempel", re.IGNORECASE
)
_WORDS_OF_PARTS = {
    3: ("ms", "millis", "millitm", "msec", "msecs", "millisec", "millisecs", "millisecond", "milliseconds",
        "millisekunde", "millisekunden", "millisecondes", "milisegundos"),
    6: ("us", "µs", "μs", "micros", "usec", "usecs", "microsec", "microsecs", "microsecond", "microseconds",
        "mikrosekunde", "mikrosekunden"),
    9: ("ns", "nanos", "nsec", "nsecs", "nanosec", "nanosecs", "nanosecond", "nanoseconds", "nanosekunden"),
}  # fmt: skip
"""Words for parts of a second, by their digits."""
_DIGITS = {word: digits for digits, words in _WORDS_OF_PARTS.items() for word in words}
_SECONDS = re.compile(r"(?P<stem>.*?)(?<![^\W_])(?:secs?|seconds?)", re.IGNORECASE)
_DATE_TEXT = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?= 00:00:00$|$)")
_CLOCK_TEXT = re.compile(
    r"(?P<whole>.*\d:\d{2}:\d{2})(?P<part>[.,:]\d+)?(?P<noon>\s*[AP]\.?M\.?)?", re.IGNORECASE
)
_BRACKETS = re.compile(r"\s*[\[(][^\[\]()]*[\])]\s*$")


JOINT = " + "
"""What joins the names of the parts of an instant."""


class _Joined(NamedTuple):
    """Columns that are an instant together."""

    parts: tuple[str, ...]
    """Columns: of whole seconds, or texts of date and time of day."""
    fraction: str = ""
    """Column of the parts of a second; "": there is none."""
    digits: int = 0
    """Digits of these: 3 of ms."""
    kind: tuple[str, ...] = ()
    """What columns of numbers count: years to seconds, or whole seconds alone; (): they are texts."""

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.parts, self.fraction) if self.fraction else self.parts


def with_joined_instants(table: Table) -> Table:
    """Return the table with a column for each instant that stands in several of its columns."""
    found = {_name(table, one): one for group in _groups(table) for one in _instants(table, group)}
    found = {name: one for name, one in found.items() if name not in table.columns}
    if not found:
        return table

    def load(name: str, first: int, end: int) -> Column:
        return _read(table, found[name], first, end) if name in found else table.load(name, first, end)

    def load_together(names: Sequence[str]) -> Mapping[str, Column]:
        assert table.load_together is not None
        return table.load_together([name for name in names if name not in found])

    headers: dict[str, Header] = {}  # each before its parts, as it tells more than any of them
    for name, header in table.columns.items():
        headers |= {whole: Header(shape=header.shape) for whole, one in found.items() if one.parts[0] == name}
        headers[name] = header
    places = {
        name: Place(name, table.place(one.parts[0]).groups) for name, one in found.items() if table.places
    }
    return replace(
        table,
        columns=headers,
        load=load,
        load_together=load_together if table.load_together else None,
        places={**table.places, **places},
    )


def _groups(table: Table) -> list[dict[str, str]]:
    """Return the columns of each group by their names within it, without units in brackets."""
    found: dict[tuple[str, ...], dict[str, str]] = {}
    for name, header in table.columns.items():
        if not header.refusal:
            place = table.place(name)
            own = place.within(place.groups[-1]) if place.groups else name
            found.setdefault(place.groups, {})[_BRACKETS.sub("", own).strip()] = name
    return list(found.values())


def _instants(table: Table, group: Mapping[str, str]) -> Iterator[_Joined]:
    """Yield what the columns of a group are together, by their names and their numbers."""
    lower = {own.lower(): name for own, name in group.items()}
    clock = clock_columns(lower)
    if clock and _is_clock(table, clock):
        fraction, digits = next(
            ((lower[word], digits) for word, digits in _DIGITS.items() if word in lower), ("", 0)
        )
        one = _Joined(tuple(clock.values()), fraction, digits, kind=tuple(clock))
        yield (
            one
            if fraction and _are_alike(table, one) and _are_parts(table, one)
            else one._replace(fraction="")
        )
        return
    for own, name in lower.items():
        seconds = _SECONDS.fullmatch(own)
        stem = seconds["stem"] if seconds else None
        for word, digits in _DIGITS.items():
            if stem is None or f"{stem}{word}" not in lower:
                continue
            one = _Joined((name,), lower[f"{stem}{word}"], digits, kind=("second",))
            if _are_alike(table, one) and _are_parts(table, one) and _whole(table, name) is not None:
                yield one
    yield from _of_texts(table, group)


def _of_texts(table: Table, group: Mapping[str, str]) -> Iterator[_Joined]:
    """Yield the date and the time of day of a group, with the parts of a second that stand apart."""
    date = next(
        (name for own, name in group.items() if _DATE.fullmatch(own) and _begins(table, name, _DATE_TEXT)), ""
    )
    clocks = [
        name
        for own, name in group.items()
        if name != date and _CLOCK.fullmatch(own) and _begins(table, name, _CLOCK_TEXT)
    ]
    if not clocks:
        return
    told = _CLOCK_TEXT.fullmatch(_text(table, clocks[0]))
    has_date = told is not None and _DATE_TEXT.match(told["whole"].partition(" ")[0]) is not None
    parts = (date, clocks[0]) if date and not has_date else (clocks[0],)
    for own, name in group.items() if told and not told["part"] else ():
        one = _Joined(parts, name, _DIGITS.get(own.lower(), 0))
        if one.digits and _are_alike(table, one) and _are_parts(table, one):
            yield one
            return
    if len(parts) > 1 and _are_alike(table, _Joined(parts)):
        yield _Joined(parts)


def _are_alike(table: Table, one: _Joined) -> bool:
    shapes = {table.columns[name].shape for name in one.names}
    return len(shapes) == 1 and len(shapes.pop()) == 1


def _begins(table: Table, name: str, form: re.Pattern[str]) -> bool:
    return form.match(_text(table, name)) is not None


def _text(table: Table, name: str) -> str:
    """Return the first cell of a column of texts; "" of others."""
    header = table.columns[name]
    if (
        not header.shape
        or not header.shape[0]
        or (header.dtype is not None and header.dtype.kind in "biufcmM")
    ):
        return ""
    try:
        return _as_texts(table.load(name, 0, 1))[0]
    except (ValueError, IndexError):
        return ""


def _as_texts(cells: NDArray[Any]) -> list[str]:
    return [text_of(cell) for cell in cells.reshape(-1)]


def _whole(table: Table, name: str) -> NDArray[np.float64] | None:
    """Return the numbers of a column, all of them whole; None: it has others."""
    try:
        values = table.load(name, 0, table.columns[name].shape[0])
    except ValueError:
        return None
    if values.dtype.kind not in "iuf" or not len(values):
        return None
    numbers = values.astype(np.float64)
    return numbers if np.all(numbers == np.round(numbers)) else None


def _is_clock(table: Table, clock: Mapping[str, str]) -> bool:
    """Return whether the columns of a clock, by what they count, have one length and numbers of it."""

    def numbers(part: str) -> NDArray[np.float64] | None:
        name = clock[part]
        try:
            values = table.load(name, 0, table.columns[name].shape[0])
        except ValueError:
            return None
        return values.astype(np.float64) if values.dtype.kind in "iuf" and len(values) else None

    return _are_alike(table, _Joined(tuple(clock.values()))) and are_clock(tuple(clock), numbers)


def _are_parts(table: Table, one: _Joined) -> bool:
    """Return whether numbers are parts of a second, which begin again with each, and do not count on."""
    numbers = _whole(table, one.fraction)
    if numbers is None or numbers.min() < 0.0 or numbers.max() >= 10.0**one.digits:
        return False
    counts_on = len(numbers) > 1 and bool(np.all(np.diff(numbers) > 0.0))
    last = table.load(one.parts[-1], 0, len(numbers))
    return not (counts_on and last[0] != last[-1])


def _name(table: Table, one: _Joined) -> str:
    first, *others = one.names
    owns = [table.place(name).within((table.place(name).groups or ("",))[-1]) for name in others]
    return JOINT.join([first, *owns])


def _read(table: Table, one: _Joined, first: int, end: int) -> Column:
    """Return rows [first, end) of instants: texts of dates, or seconds as whole nanoseconds."""
    parts = None if not one.fraction else table.load(one.fraction, first, end)
    if one.kind:
        beyond = 0 if parts is None else np.asarray(parts).astype(np.int64) * 10 ** (9 - one.digits)
        columns = [np.asarray(table.load(name, first, end)) for name in one.parts]
        whole = 10**9 * columns[0].astype(np.int64) if len(columns) == 1 else clock_ns(
            {part: column.astype(np.float64) for part, column in zip(one.kind, columns, strict=True)}
        )  # fmt: skip
        return np.asarray(whole + beyond).astype("timedelta64[ns]")
    *date, clock = (_as_texts(table.load(name, first, end)) for name in one.parts)
    texts = clock if parts is None else [
        _with_part(text, f"{int(part):0{one.digits}d}") for text, part in zip(clock, parts, strict=True)
    ]  # fmt: skip
    days = [text.removesuffix(" 00:00:00") for text in date[0]] if date else []
    return np.array(
        [f"{day} {text}" for day, text in zip(days, texts, strict=True)] if days else texts, dtype=object
    )


def _with_part(clock: str, part: str) -> str:
    told = _CLOCK_TEXT.fullmatch(clock)
    return clock if told is None else f"{told['whole']}.{part}{told['noon'] or ''}"
