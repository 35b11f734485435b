"""The unit that a file states for a column, in whatever words, held against the manifest's.

Instruments write `m/s2`, `Volts`, `Ohm`, `deg C`; some words have two meanings (`g`: gram or standard gravity, `C`:
coulomb or degree Celsius). A stated unit agrees if one of its meanings does.
"""

from __future__ import annotations

import re

from rtctl.border.units.unit_text import common_units, parsed_unit
from rtctl.measured.units import same_unit

_NOTHING = frozenset(
    {"", "-", "--", "---", "none", "no unit", "unitless", "n/a", "na", "nan", "null", "unknown", "?", "[]"}
)
"""Words by which programs fill a field that has no unit, in lower case."""
_ANY_UNIT = frozenset({"eu", "arb", "arb.", "a.u.", "au"})
"""Words for a unit that is not told (engineering or arbitrary units), which pint takes for others."""
_WORDS = {
    "amp": "A", "amps": "A", "khz": "kHz", "hz": "Hz", "sec": "s", "secs": "s", "msec": "ms", "usec": "us",
    "nsec": "ns", "deg": "degree", "degs": "degree", "gn": "g_0", "gs": "g_0", "kgf": "kgf",
}  # fmt: skip
_TWO_MEANINGS = {
    "g": ("g", "g_0"),
    "G": ("gauss", "g_0"),
    "C": ("coulomb", "degC"),
    "F": ("farad", "degF"),
    "degrees": ("degree", "degC"),
    "deg": ("degree", "degC"),
    "°": ("degree", "degC"),
    "mil": ("thou", "mil"),
    "mils": ("thou", "mil"),
}
_FULL_NAMES = re.compile(
    r"((?:micro|milli|centi|nano|kilo|mega)?"
    r"(?:ohm|hertz|volt|ampere|newton|met(?:er|re)|second|pascal|gauss|tesla|degree|radian|kelvin|celsius|inch|micron|"
    r"henry|farad|watt|joule|gram))(s|es)?\b",
    re.IGNORECASE,
)
_EXPONENT = re.compile(r"(?<=[^\W\d_])(-?\d)(?![\d.]*[^\W\d_])")
"""A digit right after a name, and no name after it: s2, s-2."""
_CELSIUS = re.compile(r"^\s*(deg(?:rees?)?\s*C(?:elsius)?|°\s*C|℃|celsius)\s*$", re.IGNORECASE)
_IN_NAME = re.compile(r"^(?P<name>.*\S)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*$")
_TIME_SUFFIX = re.compile(r"(?:^|[_\s])(ns|us|µs|μs|ms|sec|s|min)$|(?:^|[_\s])(nanos|micros|millis|seconds)$")
_TIME_WORDS = {"nanos": "ns", "micros": "us", "millis": "ms", "seconds": "s", "sec": "s"}
_SINCE = re.compile(r"\s+(since|after)\s+\S.*$", re.IGNORECASE)


def is_no_unit(text: str) -> bool:
    """Return whether a stated text only fills the place of a unit."""
    return text.strip().lower() in _NOTHING


def agrees(stated: str, unit: str) -> bool:
    """Return whether one meaning of a `stated` unit is `unit`. Raises ValueError where it has no meaning."""
    found = [same_unit(meaning, unit) for meaning in meanings(stated)]
    return any(found)


def readable(stated: str) -> bool:
    """Return whether a stated text is a unit."""
    if stated.strip().lower() in _ANY_UNIT:
        return False
    try:
        agrees(stated, "dimensionless")
    except ValueError:
        return False
    return True


def is_common(stated: str) -> bool:
    """Return whether a stated text is one of the units that people use for signals."""
    return readable(stated) and any(parsed_unit(one) in common_units() for one in meanings(stated))


def normalised(stated: str) -> str:
    """Return a stated unit as pint reads it: `m/s2` as `m/s^2`, `kOhm` as `kohm`, `deg C` as `degC`."""
    text = stated.strip().replace("º", "°")
    if _CELSIUS.match(text):
        return "degC"
    text = _FULL_NAMES.sub(lambda found: found[1].lower(), text)
    text = re.sub(r"[^\W\d_]+", lambda word: _WORDS.get(word[0].lower(), word[0]), text)
    return _EXPONENT.sub(r"^\1", text)


def time_unit_of(stated: str) -> str:
    """Return the unit of a stated unit of time, as pint reads it; "seconds since 1970-01-01" is s."""
    return normalised(_SINCE.sub("", stated))


def unit_in_name(name: str) -> str | None:
    """Return the text in brackets at the end of a column's name, if it is a unit: `x tip [mm]`, `t (ms)`."""
    found = _IN_NAME.match(name)
    if found is None:
        return None
    text = found["unit"].strip()
    has_letter = any(letter.isalpha() or letter in "°%" for letter in text)
    return text if has_letter and readable(text) else None


def time_unit_in_name(name: str) -> str | None:
    """Return the unit of time that a column's name ends with: `t_ms`, `time (us)`, `millis`."""
    found = _TIME_SUFFIX.search(name.strip().lower())
    if found is None:
        return None
    word = found[1] or found[2]
    return _TIME_WORDS.get(word, word)


def meanings(stated: str) -> tuple[str, ...]:
    """Return what a stated unit may mean, as pint reads it: `g` as `g` and `g_0`."""
    text = stated.strip().replace("º", "°")
    return _TWO_MEANINGS.get(text) or (normalised(text),)
