"""The unit that a file states for a column, in whatever words, held against the manifest's.

Instruments write `m/s2`, `Volts`, `Ohm`, `deg C`; some words have two meanings (`g`: gram or standard gravity, `C`:
coulomb or degree Celsius). A stated unit agrees if one of its meanings does.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.units.unit_text import common_units, parsed_unit
from rtctl.measured.amplitude_unit import (
    TO_PEAK,
    AmplitudeUnit,
    amplitude_unit,
    convention_in_name,
    is_level,
    level_at_end,
)
from rtctl.measured.units import check_unit, convert_column, same_unit

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
    "MM": ("mm",),
    "CM": ("cm",),
    "UM": ("um",),
    "Nm": ("N*m",),
    "mNm": ("mN*m",),
    "Nmm": ("N*mm",),
    "kNm": ("kN*m",),
    "kn": ("kN", "knot"),
}
"""Units that pint takes for others, or for one of two. Torques have no sign between their units; nm is a length."""
_FULL_NAMES = re.compile(
    r"((?:micro|milli|centi|nano|kilo|mega)?"
    r"(?:ohm|hertz|volt|ampere|newton|met(?:er|re)|second|pascal|gauss|tesla|degree|radian|kelvin|celsius|inch|micron|"
    r"henry|farad|watt|joule|gram))(s|es)?\b",
    re.IGNORECASE,
)
_EXPONENT = re.compile(r"(?<=[^\W\d_])(?<!\d[eE])(-?\d)(?![\d.]*[^\W\d_])")
"""A digit right after a name, and no name after it: s2, s-2; none of 1e-3."""
_PER_SECOND = re.compile(r"(?P<metre>[munckμµ]?m)s(?:\^|\*\*)?\(?[-−⁻](?P<power>[12¹²])\)?")
"""Metres per second without a sign between them, `ms⁻²`: a power of a millisecond is no signal."""
_TIMES_TEN = re.compile(
    r"\s*(?:10\s*(?:\^|\*\*)\s*(?P<power>[+-]?\d{1,2})|1?[eE](?P<short>[+-]?\d{1,2})|(?P<plain>1\.?0*|10+|0?[.,]0*1))"
    r"\s*[*·×x ]\s*(?P<unit>[^\W\d_].*)"
)
"""A power of ten before a unit: `1e-3 m`, `10^-6 m`, `0.001 m`, `E-6*m`."""
_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", -2: "c", 0: "", 3: "k", 6: "M", 9: "G"}
_NUMBERED = re.compile(r"[\d.,]+(?:[eE^][+-]?\d+)?\s*[*·× ]\s*[^\W\d_]\S*")
"""A number before a unit, which is no unit of the list: `0.1 mm`."""
_FACTOR = r"(?:10\s?(?:\^|\*\*)\s?[+-]?\d+|\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_SCALE_IN_NAME = re.compile(
    rf"[*×·]\s*(?P<times>{_FACTOR})(?!\w)|(?<![\w.,])(?P<before>{_FACTOR})\s*[*×·](?=\s*(?!log)[^\W\d])|"
    r"(?:(?<=[\s(\[,])x\s?|_x(?=100))(?P<fold>10+(?:\s?\^\s?[+-]?\d+)?)(?![\w^])|(?<![^\W_])(?P<folded>10+)\s?x(?!\w)|"
    rf"(?:(?<=[\w\])])\s?/\s?(?=10+(?!\w))|(?<![^\W_])[^\W\d_]/(?=\d)|(?<![^\W_])div(?:ided)?(?:[\s_]by)?[\s_]?)"
    rf"(?P<over>{_FACTOR})(?!\w)|(?<![\w:.])1\s?:\s?(?P<ratio>10+)(?![\w:.])",
    re.IGNORECASE,
)
"""A scale in a name: `x*1000`, `1000*x`, `x (x1000)`, `x/10`, `u_div_2`.

A node such as `acc x2` and a logarithm, `20*log10(x)`, have none.
"""
_CELSIUS = re.compile(r"^\s*(deg(?:rees?)?\s*C(?:elsius)?|°\s*C|℃|celsius)\s*$", re.IGNORECASE)
_IN_NAME = re.compile(r"^(?P<name>.*\S)\s*[\[(](?P<unit>[^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*$")
_TIME_SUFFIX = re.compile(r"(?:^|[_\s])(ns|us|µs|μs|ms|sec|s|min)$|(?:^|[_\s])(nanos|micros|millis|seconds)$")
_TIME_WORDS = {"nanos": "ns", "micros": "us", "millis": "ms", "seconds": "s", "sec": "s"}
SINCE = re.compile(r"\s+(since|after)\s+\S.*$", re.IGNORECASE)
"""Origin behind a unit of time, as NetCDF writes it: `seconds since 1970-01-01`."""


def is_no_unit(text: str) -> bool:
    """Return whether a stated text only fills the place of a unit."""
    return text.strip().lower() in _NOTHING


def agrees(stated: str, unit: str) -> bool:
    """Return whether one meaning of a `stated` unit is `unit`. Raises ValueError where it has no meaning."""
    found = [same_unit(meaning, unit) for meaning in meanings(stated)]
    return any(found)


def readable(stated: str) -> bool:
    """Return whether a stated text is a unit of a signal: decibels and `V rms` are none."""
    if stated.strip().lower() in _ANY_UNIT or stated_amplitude(stated) is not None:
        return False
    try:
        agrees(stated, "dimensionless")
    except ValueError:
        return False
    return True


def is_common(stated: str) -> bool:
    """Return whether a stated text is one of the units that people use for signals."""
    return readable(stated) and any(parsed_unit(one) in common_units() for one in meanings(stated))


def told_amplitude(
    told: str | None, stated: AmplitudeUnit | None, name: str, plain: str | None
) -> AmplitudeUnit | None:
    """Return what the amplitudes in a column are: what a manifest has told, else what its file states; None: neither.

    Args:
        told: The manifest's `amplitude_unit`.
        stated: What the file states, where it is more than a plain unit.
        name: The column.
        plain: The unit that the file states, in its words.

    Raises:
        ValueError: The two contradict each other, or nobody tells what 0 dB is.
    """
    found = stated
    if told is not None:
        found = stated_amplitude(told) or AmplitudeUnit(told)
        if stated is None and plain is not None and readable(plain):
            stated = AmplitudeUnit(plain)
        if stated is not None and not _is_of(stated, found):
            raise ValueError(
                f'the file states "{plain or name}" for column "{name}", the manifest has amplitude_unit = "{told}"; '
                "correct one"
            )
    if found is not None and not found.unit:
        raise ValueError(
            f'column "{name}" is in decibels, and nobody tells what 0 dB is: write it as amplitude_unit = '
            '"dB re 1 um" of its signal, or export the magnitude in a linear unit'
        )
    return found


def converted_amplitude(values: FloatArray, amplitude: AmplitudeUnit, to: str, name: str) -> FloatArray:
    """Return peak values (n,) of a column in the unit `to`. Raises ValueError in words for an incompatible unit."""
    for one in ratio_meanings(amplitude.unit):
        if parsed_unit(one).dimensionality == parsed_unit(to).dimensionality:
            return convert_column(values, one, to)
    raise ValueError(
        f'column "{name}" is in "{amplitude.text}", which is not compatible with {to}; correct one'
    )


def ratio_meanings(stated: str) -> list[str]:
    """Return what a unit may mean, or a ratio of two: `g/V` as g/V and g_0/V."""
    above, slash, below = stated.rpartition("/")
    if not slash or not readable(above) or not readable(below):
        return list(meanings(stated))
    ratios = [f"({one})/({other})" for one in meanings(above) for other in meanings(below)]
    return [*meanings(stated), *ratios]


def _is_of(stated: AmplitudeUnit, told: AmplitudeUnit) -> bool:
    """Return whether what a file states leaves room for what was told: neither says the opposite of the other."""
    if stated.convention and TO_PEAK[stated.convention] != TO_PEAK[told.convention]:
        return False
    if stated.is_level != told.is_level or not stated.unit:
        return stated.is_level == told.is_level
    if not any(same_unit(one, other) for one in meanings(stated.unit) for other in meanings(told.unit)):
        return False
    return math.isclose(stated.reference, told.reference)


def normalised(stated: str) -> str:
    """Return a stated unit as pint reads it: `m/s2` as `m/s^2`, `kOhm` as `kohm`, `deg C` as `degC`."""
    text = _with_prefix(stated.strip().replace("º", "°"))
    if motion := _PER_SECOND.fullmatch(text):
        return f"{motion['metre']}/s" + ("^2" if motion["power"] in "2²" else "")
    if _CELSIUS.match(text):
        return "degC"
    text = _FULL_NAMES.sub(lambda found: found[1].lower(), text)
    text = re.sub(r"[^\W\d_]+", lambda word: _WORDS.get(word[0].lower(), word[0]), text)
    return _EXPONENT.sub(r"^\1", text)


def _with_prefix(text: str) -> str:
    """Return a unit behind a power of ten with its prefix, `1e-3 m` as `mm`; another text as it is."""
    found = _TIMES_TEN.fullmatch(text)
    if found is None:
        return text
    number = found["plain"]
    power = int(found["power"] or found["short"] or 0) if number is None else _power_of(number)
    unit = normalised(found["unit"])
    prefixed = f"{_PREFIXES.get(power, '?')}{unit}"
    try:
        check_unit(prefixed, unit)
        factor = float(convert_column(np.ones(1), prefixed, unit)[0])
    except ValueError:
        return text
    return prefixed if math.isclose(factor, 10.0**power) else text  # 1e-3 m^2 is no mm^2


def _power_of(number: str) -> int:
    """Return the power of ten that a text such as 0.001 is."""
    return round(math.log10(float(number.replace(",", "."))))


def time_unit_of(stated: str) -> str:
    """Return the unit of a stated unit of time, as pint reads it; "seconds since 1970-01-01" is s."""
    return normalised(SINCE.sub("", stated))


class NamedScale(NamedTuple):
    """A scale that stands in a name."""

    text: str
    """As it is written: `*1000`."""
    per_number: float
    """What one number of the column counts if its numbers were made by that scale: 0.001."""


def scale_in_name(name: str) -> NamedScale | None:
    """Return the scale in a column's name, which may have been applied to its numbers, or be still to be applied."""
    unit = _IN_NAME.match(name)
    if unit is not None and readable(unit["unit"].strip()):
        name = unit["name"]
    found = _SCALE_IN_NAME.search(name)
    if found is None:
        return None
    kind = next(key for key, value in found.groupdict().items() if value)
    mantissa, _, power = re.sub(r"\s|\*\*", "^", found[kind]).partition("^")
    factor = 10.0 ** int(power.strip("^")) if power else float(mantissa.replace(",", "."))
    if factor in (0.0, 1.0):
        return None
    return NamedScale(found[0].strip(" ([,_"), factor if kind in ("over", "ratio") else 1.0 / factor)


def unit_in_name(name: str) -> str | None:
    """Return the unit at the end of a column's name: in brackets, `x tip [mm]`, `U (V rms)`; decibels also without.

    Beside a scale, `x*1000 [m]`, it is not the unit of the numbers: None.
    """
    return None if scale_in_name(name) else unit_beside_name(name)


def unit_beside_name(name: str) -> str | None:
    """Return the unit at the end of a column's name, also beside a scale, where it may be that of other numbers."""
    found = _IN_NAME.match(name)
    text = "" if found is None else found["unit"].strip()
    if not is_level(text) and (level := level_at_end(name)) is not None:
        return level
    has_letter = any(letter.isalpha() or letter in "°%" for letter in text)
    is_one = has_letter and (readable(text) or stated_amplitude(text) is not None)
    return text if is_one or _NUMBERED.fullmatch(text) else None


def stated_amplitude(text: str) -> AmplitudeUnit | None:
    """Return the amplitude that a stated text means, of a known unit; None: it is a plain unit, or none at all."""
    found = amplitude_unit(text)
    if found is None or not found.unit or readable(found.unit):
        return found
    return found._replace(unit="", reference=1.0) if found.is_level else None


def column_amplitude(name: str, stated: str | None) -> AmplitudeUnit | None:
    """Return the amplitude that a column's name and the unit that its file states mean; None: they say neither."""
    text = stated or unit_in_name(name)
    convention = convention_in_name(name)
    if text is None:
        found = stated_amplitude(name)  # a column that is called `V pk`
        return found if found is not None and (found.is_level or is_common(found.unit)) else None
    found = stated_amplitude(text)
    if found is None and convention and readable(text):
        return AmplitudeUnit(text, convention=convention)
    return found._replace(convention=found.convention or convention) if found is not None else None


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
