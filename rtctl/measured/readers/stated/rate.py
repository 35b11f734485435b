"""The sample rate that attributes of a column, its group or its file state, by one rule for all formats.

A key is read without signs and blanks, and may end with a unit: `sample_rate_Hz`, `Sampling Rate`, `fs`, `dt_ms`. A
text may have the unit too: "2.5 kHz".
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rtctl.measured.readers.stated.attributes import numbers_of, text_of
from rtctl.measured.readers.stated.keys import is_unit_of

_RATES = (
    "samplerate", "samplingrate", "samplefrequency", "samplingfrequency", "samplefreq", "samplingfreq", "abtastrate",
    "abtastfrequenz", "scanrate", "fsamp", "fs", "samplespersecond", "acquisitionrate", "messrate",
    "framerate", "outputdatarate", "odr",
    "frequencedechantillonnage", "frecuenciademuestreo", "frequenzadicampionamento",
)  # fmt: skip
_PERIODS = (
    "sampletime", "sampleperiod", "sampleinterval", "samplingtime", "samplingperiod", "samplinginterval", "abtastzeit",
    "samplingcycle", "tinterval", "tinc", "timeincrement", "abtastintervall",
    "deltat", "δt", "dt", "periodedechantillonnage", "periododemuestreo",
    "periododicampionamento",
)  # fmt: skip
"""Keys of a rate and of a period, without signs, blanks and accents; a unit may follow."""
_FACTORS: dict[str, tuple[float, bool] | None] = {
    "": None, "hz": (1.0, True), "khz": (1e3, True), "mhz": (1e6, True), "millihz": (1e-3, True), "hertz": (1.0, True),
    "sps": (1.0, True), "ksps": (1e3, True), "ss": (1.0, True), "kss": (1e3, True), "mss": (1e6, True),
    "sas": (1.0, True), "ksas": (1e3, True), "msas": (1e6, True), "1s": (1.0, True), "sampless": (1.0, True),
    "samplessec": (1.0, True), "samplespersecond": (1.0, True),
    "fps": (1.0, True), "framess": (1.0, True),
    "s": (1.0, False), "sec": (1.0, False), "second": (1.0, False), "seconds": (1.0, False), "sekunden": (1.0, False),
    "ms": (1e-3, False), "msec": (1e-3, False), "us": (1e-6, False), "usec": (1e-6, False), "ns": (1e-9, False),
    "min": (60.0, False), "h": (3600.0, False),
}  # fmt: skip
"""Units with their size in Hz or s, and whether they are of a rate; "" is Hz or s."""
VARIABLES = ("ts", "tsamp", "xinc", "xincr", "xincrement")
"""Further words for a period that variables have; an attribute `ts` is a time stamp as often, `xinc` a length."""
_BRACKETS = re.compile(r"(.*\S)\s*[\[(]([^\[\]()]*)[\])]\W*")


class RateKey(NamedTuple):
    """A key that names a sample rate or a sample period."""

    base: str
    unit: str
    """Unit that it ends with, as in `_FACTORS`; "": none."""
    is_rate: bool


def stated_period(*levels: Mapping[str, Any], periods: tuple[str, ...] = ()) -> tuple[float, str] | None:
    """Return the sample period [s] that attributes state, and under which key; None: none does.

    Args:
        levels: Attributes of the column, of its group, and so on to those of the file: the first that has one counts.
        periods: Further words for a period.
    """
    for attributes in levels:
        for key, value in attributes.items():
            named = rate_key(key, periods=periods)
            period_s = None if named is None else _period_s(named, value, _unit_beside(attributes, key))
            if period_s is not None:
                return period_s, f'by "{key}"'
    return None


def rate_key(key: str, rates: tuple[str, ...] = (), periods: tuple[str, ...] = ()) -> RateKey | None:
    """Return what a key names; None: no rate and no period. `rates` and `periods` are further words for them."""
    found = _BRACKETS.fullmatch(key)  # apart from the name: `t [s]` is not `ts`
    name, unit = _plain(found[1] if found else key), _plain(found[2]) if found else ""
    for base in (*_RATES, *_PERIODS, *rates, *periods):
        end = name[len(base) :].removeprefix("in")
        if name.startswith(base) and end in _FACTORS and unit in _FACTORS:
            return RateKey(base, unit or end, base in _RATES or base in rates)
    return None


def may_have_key(text: str, more: tuple[str, ...]) -> bool:
    """Return whether a text has a word for a rate or a period, also one of `more`, anywhere."""
    plain = _plain(text)
    return any(base in plain for base in (*_RATES, *_PERIODS, *more))


def is_rate_unit(text: str) -> bool:
    """Return whether a text is a unit of rates or of periods."""
    return _FACTORS.get(_plain(text)) is not None


def period_of(key: RateKey, number: float, unit: str) -> float | None:
    """Return the period [s] of a number in its unit, or in that of its key where it has none; None: it is none."""
    unit = _plain(unit) or key.unit
    if not 0.0 < number < np.inf or unit not in _FACTORS:
        return None
    factor = _FACTORS[unit] or (1.0, key.is_rate)
    if factor[1] != key.is_rate:
        return None
    size = number * factor[0]
    return 1.0 / size if key.is_rate else size


def _plain(text: str) -> str:
    """Return a text in lower case without signs, blanks and accents; mHz is not MHz."""
    text = text.replace("mHz", "millihz").replace("µ", "u").replace("μ", "u")
    text = "".join(one for one in unicodedata.normalize("NFD", text) if not unicodedata.combining(one))
    return re.sub(r"[\W_]+", "", text.lower())


def _unit_beside(attributes: Mapping[str, Any], key: str) -> str:
    """Return the unit that another key states for this one: `dt_unit` beside `dt`; "": none does."""
    return next(
        (text for other, value in attributes.items() if is_unit_of(other, key) and (text := text_of(value))),
        "",
    )


def _period_s(key: RateKey, value: Any, unit: str) -> float | None:
    """Return the period [s] of a rate or a period; None where the value is no such number, or of another unit."""
    told = re.fullmatch(r"([\d.,eE+-]+)\s*([A-Za-zµμ/]*)", text_of(value)) if text_of(value) else None
    try:
        numbers = numbers_of(told[1].replace(",", ".") if told else value)
    except (ValueError, TypeError):
        return None
    return period_of(key, float(numbers[0]), (told[2] if told else "") or unit) if len(numbers) == 1 else None
