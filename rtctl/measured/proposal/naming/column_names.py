"""Names of columns as people write them, in several habits and languages: what they mean, which unit they end with.

A name is cut into its words and its unit: `Drive [V]`, `acc (g)`, `Weg/mm`, `disp_mm`, `Weg in mm`. A word of some
length tells the quantity; a single letter (`u`, `x`) is a weaker hint.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from rtctl.measured.amplitude_unit import level_at_end
from rtctl.measured.stated_unit import SINCE, meanings, readable, unit_beside_name

STRONG, WEAK = 4.0, 2.0
"""Votes of a word and of a single letter; a unit's vote lies between (`column_units.UNIT_VOTE`)."""

_WORDS: dict[str, str] = {
    "time": "time timestamp stamp zeit uhrzeit zeitstempel datum temps tiempo tempo elapsed datetime date clock "
    "seconds secs nsecs nsec nanosec nanosecs millis micros milliseconds microseconds nanoseconds millisekunden "
    "x_value abscissa",
    "index": "index idx sample samples nr no number count counter row id point nummer zeile",
    "rate": "fs fsamp samplerate samplingrate samplefrequency samplingfrequency abtastrate rate",
    "period": "dt deltat delta_t ts tsamp sampletime sampleperiod samplingperiod sampling_interval",
    "drive": "drive drv input inp vin uin excitation exc exciter force kraft load cmd command voltage spannung volt "
    "anregung erregung shaker stimulus stim torque moment actuator aktor amplifier amp base generator gen dac "
    "setpoint eingang stell hammer field",
    "current": "current curr strom icoil coil amps",
    "resistance": "resistance res widerstand ohm ohms",
    "deflection": "deflection defl auslenkung biegung bending durchbiegung",
    "displacement": "displacement disp displ position pos weg lage tip angle theta phi winkel pot ldv_disp distance "
    "abstand elongation stroke hub lvdt laser displ1",
    "velocity": "velocity vel speed geschwindigkeit xdot dx xd vibrometer ldv dxdt",
    "acceleration": "acceleration acc accel accelerometer beschleunigung xdd ddx xddot acceleration1 beschl",
    "response": "output out response resp ausgang antwort sensor measured signal vout",
    "none": "temperature temp temperatur humidity pressure marker trigger trig event flag status comment",
}
_SORTS = frozenset(["voltage", "spannung", "volt", "amplifier", "amp", "number", "sample", "point", "tip"])
"""Words that yield to every other one: `output voltage` is an output, `acc tip` an acceleration."""
_LETTERS = {
    "t": ("time",), "n": ("index",), "k": ("index",),
    "u": ("drive",), "f": ("drive",),
    "v": ("velocity", "drive"), "i": ("current",), "r": ("resistance",),
    "x": ("displacement",), "z": ("displacement",), "q": ("displacement",), "d": ("displacement",),
    "s": ("displacement",), "w": ("displacement",),
    "a": ("acceleration",), "y": ("response",),
}  # fmt: skip
_MEANING = {word: quantity for quantity, words in _WORDS.items() for word in words.split()}
_WRITTEN_UNIT = re.compile(
    r"[munpkMµμ]?(?:V|A|N|W|J|Ohm|ohm|Ω|Pa|Hz|T|Nm)|m?bar|psi|rpm|[munpkcµμ]?m|[munµμ]?s|sec|g|m?rad|deg|"
    r"(?:[muncµμ]?m)(?:/|_|p)?s(?:2|\^2|²|s)?|mps2?|ms2|mms2?|rad(?:/|_)s(?:2|\^2)?"
)
"""Units that stand at the end of a name without brackets; `in` (inch) is not among them: it means input."""
_WEIGHTS = frozenset(
    ["force", "kraft", "load", "last", "weight", "gewicht", "mass", "masse", "torque", "moment", "f", "m"]
)
"""Words of what may be measured in grams."""
_CHANNEL = re.compile(r"[ABDaibd]\d+")
"""A channel of an instrument: `A1`, `b0`."""
_FIELD_OF_MESSAGE = "field."
"""What ROS writes in front of the names of a message's fields, `field.header.stamp`."""
_NODE = re.compile(r"\d+:[+-]?R?[SXYZ]\b( #\d+)?")
"""Node and direction behind the names of a universal file."""
_SPELLED = {
    "ma": "mA", "mv": "mV", "kv": "kV", "kn": "kN", "mn": "mN", "hz": "Hz", "kohm": "kohm", "mps": "m/s",
    "mps2": "m/s^2", "ms2": "m/s^2", "mss": "m/s^2", "m_s": "m/s", "mm_s": "mm/s", "um_s": "um/s", "m_s2": "m/s^2",
    "mm_s2": "mm/s^2", "mms": "mm/s", "mms2": "mm/s^2", "rad_s": "rad/s", "rad_s2": "rad/s^2", "ua": "uA",
    "volt": "V", "volts": "V", "newton": "N", "ampere": "A", "ohms": "ohm", "mps^2": "m/s^2", "degc": "degC",
    "degf": "degF", "°c": "degC", "celsius": "degC", "kelvin": "K",
}  # fmt: skip
_SHORT = {
    "volt": "V", "ampere": "A", "newton": "N", "meter": "m", "metre": "m", "millimeter": "mm", "millimetre": "mm",
    "micrometer": "um", "micrometre": "um", "micron": "um", "millivolt": "mV", "milliampere": "mA", "second": "s",
    "millisecond": "ms", "degree": "deg", "radian": "rad", "kelvin": "K", "pascal": "Pa",
}  # fmt: skip
_SINGLE = {"v": ("V", "drive"), "a": ("A", "current"), "n": ("N", "drive")}
"""Units in lower case that only count after a word that means what they measure: `force_n`."""
_NEEDS_WORD = {
    "m": "displacement",
    "g": "acceleration",
    "s": "time",
    "ms": "time",
    "us": "time",
    "ns": "time",
}
"""Letters at the end of a name that are often something else (`x_m`: measured), and the word that makes them units."""
_TIMES = ("s", "ms", "us", "ns")
_TEMPERATURES = {"C": "degC", "F": "degF", "K": "K"}
"""Letters at the end of a name that is called as a temperature is: `T_plate_C`."""
_TEMPERATURE = re.compile(r"(?:^|[._\s])(?:T|[Tt]emp\w*)(?:[_\s\d]|$)")


class Name(NamedTuple):
    """A column's name, read."""

    votes: dict[str, float]
    """Vote for each quantity that it may mean; empty: it says nothing."""
    unit: str
    """Unit that it ends with, in its own words; "": none."""
    habit: str
    """Where the unit stands: "in brackets", "after a slash", "at its end"; "": it has none."""


def read_name(name: str) -> Name:
    """Return what a column's name says."""
    base, unit, habit = _without_unit(name.strip().removeprefix(_FIELD_OF_MESSAGE))
    return Name(_votes(base), unit, habit)


def is_weight(name: str) -> bool:
    """Return whether a column is called as a force or a mass is, whose `g` is not standard gravity."""
    return bool(_WEIGHTS & set(_words(_without_unit(name.strip())[0])))


def bare_name(name: str) -> str:
    """Return a column's name without a unit in brackets or after a slash."""
    base, _, habit = _without_unit(name.strip())
    return base if habit in ("in brackets", "after a slash") else name.strip()


def base_name(name: str) -> str:
    """Return a column's name without its unit, wherever this stands: `phase_deg` as `phase`."""
    return _without_unit(name.strip())[0] or name.strip()


def _without_unit(name: str) -> tuple[str, str, str]:
    """Return a name without its unit, the unit, and where it stands."""
    text = unit_beside_name(name)
    if text is not None and text == level_at_end(name):
        return name[: -len(text)].strip(" _,(["), text, "at its end"
    if text:
        return name[: max(name.rfind("["), name.rfind("(", 0, name.rfind(text)))].strip(), text, "in brackets"
    base, slash, rest = name.partition("/")
    rest = rest.strip().strip("()[]")
    if slash and base.strip() and rest and any(letter.isalpha() for letter in rest) and _is_written(rest):
        return base.strip(), rest, "after a slash"
    return _with_unit_at_end(name)


def _is_written(text: str) -> bool:
    return (_WRITTEN_UNIT.fullmatch(text) is not None or any(sign in text for sign in "^²*°µΩ")) and readable(
        text
    )


def _with_unit_at_end(name: str) -> tuple[str, str, str]:
    parts = re.split(r"[_\s,]+", name)
    for count in (2, 1):
        if len(parts) <= count:
            continue
        base, end = "_".join(parts[:-count]), "_".join(parts[-count:])
        if base == "in" and end in _TIMES:  # a name that is a unit and nothing else; `in V` may be an input
            return "", end, "at its end"
        unit = _spelled(end, base)
        if unit:
            return base.removesuffix("_in"), unit, "at its end"
    return name, "", ""


def _spelled(end: str, base: str) -> str:
    """Return the unit that the end of a name is, after a `base`; "": it is none."""
    votes = _votes(base)
    if end.lower() in _SPELLED and end not in ("MN", "MV"):
        return _SPELLED[end.lower()]
    if end in _TEMPERATURES and _TEMPERATURE.search(base):
        return _TEMPERATURES[end]
    if end in _SINGLE:
        unit, quantity = _SINGLE[end]
        return unit if votes.get(quantity, 0.0) >= STRONG else ""
    if end in _NEEDS_WORD:
        least = WEAK if end in ("s", "ms", "us", "ns") else STRONG
        strong = max(votes.get(_NEEDS_WORD[end], 0.0), votes.get("deflection", 0.0) if end == "m" else 0.0)
        return end if strong >= least else ""
    if not _WRITTEN_UNIT.fullmatch(end):
        return ""
    return end if readable(end) else ""


def _votes(base: str) -> dict[str, float]:
    """Return the votes of the words of a name; a whole word outvotes a letter, the last word an earlier one."""
    words = _words(base)
    whole = _MEANING.get("".join(words)) or ("." not in base and _MEANING.get("_".join(words)))
    if whole:
        return {whole: STRONG}
    strong = [(word, _MEANING[word]) for word in words if word in _MEANING]
    if strong:
        return _most_telling(strong)
    votes: dict[str, float] = {}
    if _CHANNEL.fullmatch(base.strip()):
        return votes
    for word in words:
        for quantity in _LETTERS.get(word, ()):
            votes.setdefault(quantity, WEAK if len(_LETTERS[word]) == 1 else WEAK / 2.0)
        if votes:
            break
    return votes


def _most_telling(words: list[tuple[str, str]]) -> dict[str, float]:
    """Return the vote of a name of several words: `base acc` is a drive, `tip displacement` its last word."""
    quantities = [quantity for word, quantity in words if word not in _SORTS]
    quantities = quantities or [quantity for _, quantity in words]
    for first in ("none", "drive", "time"):
        if first in quantities:
            return {first: STRONG}
    named = [one for one in quantities if one not in ("response", "index")]
    return {(named or quantities)[-1]: STRONG}


def _words(base: str) -> list[str]:
    """Return a name's words in lower case, without digits behind them: `AccTip2` is acc, tip."""
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", _NODE.sub("", base))
    parts = [part.lower().rstrip("0123456789") for part in re.split(r"[^\w]+|_", text)]
    return [part for part in parts if part]


def unit_meanings(text: str) -> tuple[str, ...]:
    """Return what a stated unit may mean, as pint reads it; () where it is no unit."""
    text = SINCE.sub("", text)
    spelled = _SPELLED.get(text, text)
    return tuple(_SHORT.get(one, one) for one in meanings(spelled)) if readable(spelled) else ()
