"""The sample rate that lines above the columns of a text file state: `key: value unit`, with or without comment marks.

Key and value are apart by a colon, an equals sign, a separator of columns or a blank: `# Sampling rate: 2 kHz`,
`dt [ms] = 0,5`, `"Sample Interval",5.0e-4,s`. The keys are those of `rate`, at the beginning of a line looser words
too. A number whose meaning does not show is not used, and told.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rtctl.measured.readers.stated.rate import RateKey, is_rate_unit, may_have_key, period_of, rate_key

SAME = 1e-3
"""Relative difference of two periods up to which they are one."""
_LOOSE_RATES = ("rate", "sampledat", "loggingrate", "recordingrate")
_LOOSE_PERIODS = (
    "ts", "timestep", "timeincrement", "timeinterval", "scaninterval", "logginginterval", "recordinginterval",
    "zeitschritt", "pasdetemps",
)  # fmt: skip
_AXIS = ("interval", "increment", "deltax", "xincrement")
"""Words for the step of an axis, which a unit must tell to be time."""
_MAY_BE_DURATION = ("sampletime", "samplingtime")
_LONG_S = 1.0
"""Period from which on a bare number may be in ms, and a "sampling time" the duration of a record."""
_TELLING = 5
"""Letters of a key that means a rate, whatever follows: `FS: 10 V` is a full scale."""
_COARSEST = 0.01
"""Largest share of a number that is taken as its rounding."""
_SHOWN = 60
_LONGEST, _LONGEST_KEY = 500, 60
"""Characters of a line, and of a key with its unit, that are looked at."""
_MARKS = "#%;/*!'$ \t"
_NUMBER = re.compile(r"([+-]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)")
_THOUSANDS = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+") for mark in ",."}
_STAMP = re.compile(r"\d:\d|\d([/.-])\d\d?\1\d")
"""A time of day or a date: a "sampling time" may be one."""
_STARTS = re.compile(r"[;\t|]|,(?=\s)")
_SPLITS = re.compile(r"[:=\t;,]|\s(?=[\d.])")
_TIME_AXIS = re.compile(
    r"\W*(x.?dimension|x.?units?(.?label)?|horizontal.units?)\W+(time|s|secs?|seconds?)\b", re.I
)


class NumberedLine(NamedTuple):
    """A line of a file."""

    number: int
    """From 1."""
    text: str


class Preamble(NamedTuple):
    """What the lines above the columns state of the sample rate."""

    period_s: float | None = None
    source: str = ""
    """The line that states the period."""
    taken_in: str = ""
    """Unit in which its number is taken where the line gives none."""
    rounding: float = 0.0
    """Relative size of half of the last decimal of its number."""
    doubt: str = ""
    """What they state that cannot be used; "": nothing."""


NOTHING = Preamble()
"""What formats without such lines state in them."""


class _Statement(NamedTuple):
    """What one line states."""

    key: RateKey
    period_s: float | None = None
    """None: it cannot be used."""
    has_unit: bool = False
    rounding: float = 0.0
    doubt: str = ""
    """Why it cannot be used, as the end of a sentence."""
    is_number: bool = True
    """Whether it gives a number of a rate or a period, of whatever meaning."""
    is_apart: bool = True
    """Whether the line has no other numbers, so that it is no row of the columns."""


def states_rate(line: str) -> bool:
    """Return whether a line does nothing but state a sample rate or period."""
    found = _statement(line, ".", is_time=True)
    return found is not None and found.is_apart


def read_preamble(lines: Sequence[NumberedLine], decimal: str) -> Preamble:
    """Return what lines state together; `decimal` is the mark in the numbers of the file."""
    is_time = any(_TIME_AXIS.match(line.text) for line in lines)
    found = [(line, one) for line in lines if (one := _statement(line.text, decimal, is_time)) is not None]
    used = [(line, one, one.period_s) for line, one in found if one.period_s is not None]
    doubts = [f"{quoted(line)} {one.doubt}" for line, one in found if one.period_s is None]
    if not used:
        return Preamble(doubt="; ".join(doubts))
    line, finest, period_s = min(used, key=lambda one: one[1].rounding)
    for other, one, other_s in used:
        if not abs(other_s / period_s - 1.0) <= SAME + one.rounding + finest.rounding:
            first, second = sorted([(line, period_s), (other, other_s)])
            both = [f"{quoted(where)} ({1.0 / size_s:.6g} Hz)" for where, size_s in (first, second)]
            return Preamble(doubt="; ".join([f"{both[0]} and {both[1]} contradict each other", *doubts]))
    taken_in = "" if finest.has_unit else "Hz" if finest.key.is_rate else "s"
    return Preamble(period_s, quoted(line), taken_in, finest.rounding, "; ".join(doubts))


def quoted(line: NumberedLine) -> str:
    """Return a line as it is cited: `line 2 "fs = 2 kHz"`."""
    text = " ".join("".join(one if one.isprintable() else " " for one in line.text.replace('"', "")).split())
    return f'line {line.number} "{text[:_SHOWN]}{"..." if len(text) > _SHOWN else ""}"'


def _statement(line: str, decimal: str, is_time: bool) -> _Statement | None:
    """Return what a line states, if it can be something that can be used; None: nothing of a rate."""
    text = line[:_LONGEST].replace('"', "").lstrip(_MARKS)
    if not may_have_key(text, (*_LOOSE_RATES, *_LOOSE_PERIODS, *_AXIS)):
        return None
    found = list(_statements(text, decimal, is_time))
    return min(found, key=lambda one: one.period_s is None, default=None)


def _statements(text: str, decimal: str, is_time: bool) -> Iterator[_Statement]:
    for start in (0, *(match.end() for match in _STARTS.finditer(text))):
        loose = (_LOOSE_RATES, (*_LOOSE_PERIODS, *_AXIS)) if start == 0 else ((), ())
        for split in _SPLITS.finditer(text, start, start + _LONGEST_KEY):
            written = text[start : split.start()]
            key = rate_key(written, *loose)
            if key is None or (key.base == "ts" and "ts" not in written.lower()):  # `t_s` is a time
                continue
            value = text[split.end() :]
            cells = value.split(",") if split[0] == "," else re.split(r"[\t;|]|,(?!\d)", value)
            cells = [one.strip() for one in "\n".join(cells).lstrip("\n\t ").split("\n")]
            if not cells[0] or _STAMP.search(cells[0]):
                continue
            one = _value(key, cells, decimal)
            is_said = len(key.base) >= _TELLING and (split[0] in ":=" or _NUMBER.match(cells[0]))
            if one.period_s is not None:
                yield _checked(one, is_time)
            elif start == 0 and (one.is_number or is_said):
                yield one


def _value(key: RateKey, cells: Sequence[str], decimal: str) -> _Statement:
    """Return what the cells behind a key state: a number, perhaps the same for several columns, and perhaps a unit."""
    what = "rate" if key.is_rate else "period"
    unreadable = _Statement(key, doubt=f"has no {what} that can be read", is_number=False)
    numbers: list[tuple[str, str]] = []
    for cell in cells:
        match = _NUMBER.fullmatch(cell)
        if match is None or (numbers and match[2] and not _unit(match[2])):
            break
        numbers.append((match[1], _unit(match[2]) or match[2]))
    rest = cells[len(numbers) :]
    written, unit = numbers[0] if numbers else ("", "")
    unit = unit or (_unit(rest[0]) if rest else "")
    if period_of(key, 1.0, unit) is None or not numbers:
        return unreadable
    if len(set(numbers)) > 1:
        return _Statement(key, doubt="states several rates, and one is needed")
    number = _number(written, decimal)
    if number is None:
        return _Statement(key, doubt="may have a mark of decimals or of thousands in its number")
    period_s = period_of(key, number, unit)
    if period_s is None:
        return unreadable
    is_apart = not any((match := _NUMBER.fullmatch(one)) and not match[2] for one in rest)
    return _Statement(key, period_s, bool(unit or key.unit), _rounding(written), is_apart=is_apart)


def _unit(text: str) -> str:
    """Return the unit of a rate or a period that a text is or begins with, such as `Hz per channel`; "": none."""
    whole = text.strip(" []().")
    first = whole.partition(" ")[0].strip("[](),")
    return whole if is_rate_unit(whole) else first if is_rate_unit(first) else ""


def _number(written: str, decimal: str) -> float | None:
    """Return a number with a decimal point or comma; None where its mark may be one of thousands."""
    if _THOUSANDS["," if decimal == "." else "."].fullmatch(written):
        return None
    try:
        return float(written.replace(",", "."))
    except ValueError:
        return None


def _rounding(written: str) -> float:
    mantissa = written.replace(",", ".").lower().partition("e")[0]
    decimals = len(mantissa.partition(".")[2])
    return min(0.5 * 10.0**-decimals / float(mantissa), _COARSEST) if decimals else 0.0


def _checked(one: _Statement, is_time: bool) -> _Statement:
    """Return a statement without its period where its number may mean something else."""
    if one.key.is_rate or one.period_s is None:
        return one
    if not one.has_unit and one.key.base in _AXIS and not is_time:
        doubt = "may state the sample period, without its unit"
    elif one.period_s >= _LONG_S and not one.has_unit:
        doubt = "has no unit, and may be in ms"
    elif one.period_s >= _LONG_S and one.key.base in _MAY_BE_DURATION:
        doubt = "may be the duration of the record"
    else:
        return one
    return one._replace(period_s=None, doubt=doubt)
