"""Words of the keys under which files state something of their columns: `EngineeringUnits`, `x_unit`, `FillValue`.

Every program has its own spelling, so a key is taken apart into words, at signs and where small letters become
capitals, without accents, and known by them.
"""

from __future__ import annotations

import re
import unicodedata

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_UNIT_WORDS = frozenset(
    {"unit", "units", "unitstring", "unitdescription", "unitlabel", "unitofmeasure", "engineeringunits",
     "engineeringunit", "engunits", "engunit", "physicalunit", "yunit", "yunits", "uom", "einheit", "einheiten",
     "masseinheit", "unite", "unites", "unidad", "unidades", "unidade", "unita", "eenheid", "enhet"}
)  # fmt: skip
_OF_OTHER_AXES = frozenset(
    {"x", "t", "time", "wf", "wfx", "rate", "sampling", "sample", "frequency", "freq", "abscissa", "horizontal", "date",
     "calendar", "zeit", "temps", "tiempo", "phase", "cell", "item"}
)  # fmt: skip
"""Words beside that for a unit which make it one of something else than the column's numbers."""
_SCALE_WORDS = frozenset(
    {"scale", "scales", "scaling", "gains", "factors", "offsets", "sensitivities", "calibrations", "slopes",
     "scalefactor", "gain", "slope", "factor", "sensitivity", "multiplier", "calibration", "calib",
     "calfactor", "conversion", "lsb", "empfindlichkeit", "verstaerkung", "faktor", "kalibrierfaktor",
     "offset", "addoffset", "intercept", "bits", "fullscale", "fsr", "vref", "range", "sens", "coef", "coefs",
     "coeff", "coeffs", "coefficient", "coefficients", "polynomial", "attenuation", "step"}
)  # fmt: skip
_OWN_SCALE_WORDS = frozenset(
    {"resolution", "cal", "probe", "amplification", "ratio", "normalization", "normalisation", "prefix", "exponent",
     "quantum", "zero", "bias", "tare", "kalibrierfaktor", "umrechnung", "nullpunkt", "poly", "norm",
     "quantization", "quantisation"}
)  # fmt: skip
"""Words that mean a scale at a column, and other things elsewhere."""
_COEFFICIENT = re.compile(r"k|[ackp]_?\d", re.IGNORECASE)
_OWN_COEFFICIENT = re.compile(r"[abckmp](_?\d)?|power_?of_?(ten|10)", re.IGNORECASE)
"""Letters of a polynomial, of a file and of a column itself: `k`, `c1`, `b`."""
_DECIMATIONS = ("decimat", "downsampl", "subsampl", "undersampl", "dezim", "unterabtast")
"""Beginnings of words for samples that were left out."""
_BETWEEN = frozenset({"per", "to", "pro"})
_NO_RATIOS = frozenset(
    {"second", "seconds", "sec", "s", "minute", "min", "hour", "frame", "frames", "cycle", "cycles", "period", "block",
     "revolution", "noise", "peak", "point", "date", "end"}
)  # fmt: skip
"""Words beside `per` or `to` with which a key is no scale: frames per second, signal to noise."""
_ORDINATE = frozenset({"y", "vertical", "ordinate", "values"})
_OFFSET_WORDS = frozenset(
    {"offset", "addoffset", "intercept", "zero", "bias", "tare", "nullpunkt", "exponent"}
)
_NO_SCALES = frozenset(
    {"color", "colour", "gray", "grey", "log", "date", "due", "id", "serial", "type", "status", "number",
     "name", "time", "timestamp", "start", "utc", "zone", "delay", "wf", "ni", "certificate", "file", "lab", "by", "kp",
     "ki", "kd", "pid", "controller", "loop", "phase", "frequency", "rate", "quality", "crest", "power", "form",
     "safety", "margin", "damping", "duty", "q", "samples", "sample", "lines", "points"}
)  # fmt: skip
"""Words beside that for a scale with which it scales no numbers of a column."""
_FILLS = frozenset(
    {"fillvalue", "missingvalue", "nodata", "nodatavalue", "novalue", "invalidvalue", "badvalue",
     "nullvalue", "nanvalue", "dummyvalue", "undefinedvalue", "undefvalue"}
)  # fmt: skip
_FILLERS = frozenset(
    {"of", "for", "the", "channel", "column", "signal", "eng", "engineering", "physical", "display"}
)


def words_of(key: str) -> list[str]:
    """Return the words of a key in lower case: `EngineeringUnits` as engineering, units."""
    plain = unicodedata.normalize("NFD", key.replace("ß", "ss"))
    plain = "".join(one for one in plain if not unicodedata.combining(one))
    return [word.lower() for word in _WORD.findall(plain)]


def is_unit_key(key: str) -> bool:
    """Return whether a key of a column names the unit of its numbers, not that of its time or of its abscissa."""
    rest = _beside(key, _UNIT_WORDS)
    return rest is not None and not rest & _OF_OTHER_AXES


def is_unit_of(key: str, column: str) -> bool:
    """Return whether a key that stands beside columns names the unit of this one: `x_unit`, `unit of x`."""
    rest = _beside(key, _UNIT_WORDS)
    return bool(rest) and rest == set(words_of(column)) - _FILLERS


def is_unit_of_all(key: str) -> bool:
    """Return whether a key names units and nothing that has them: `units`, `EngineeringUnits`, `Y_Unit_Label`."""
    rest = _beside(key, _UNIT_WORDS)
    return rest is not None and rest <= _ORDINATE


def is_scale_key(key: str) -> bool:
    """Return whether a key may name a scale or an offset of numbers, also as one unit in another: `mm_per_V`."""
    words = words_of(key)
    if is_decimation_key(key):
        return False
    is_ratio = any(one in _BETWEEN for one in words[1:-1]) and not set(words) & _NO_RATIOS
    is_one = is_ratio or bool(set(words) & _SCALE_WORDS) or _COEFFICIENT.fullmatch(key) is not None
    return is_one and not set(words) & _NO_SCALES


def is_own_scale_key(key: str) -> bool:
    """Return whether a key of a column itself may name a scale: there more words are one than in a group."""
    words = set(words_of(key))
    if is_scale_key(key) or _OWN_COEFFICIENT.fullmatch(key) is not None:
        return True
    return bool(words & _OWN_SCALE_WORDS) and not words & _NO_SCALES


def is_decimation_key(key: str) -> bool:
    """Return whether a key names how many samples were left out: `decimation`, `down_sampling_factor`."""
    joined = "".join(words_of(key))
    return any(word in joined for word in _DECIMATIONS)


def says_of_columns(key: str) -> bool:
    """Return whether a key that stands beside columns may say how their numbers are to be read."""
    is_one = _beside(key, _UNIT_WORDS) is not None or is_scale_key(key) or is_fill_key(key)
    return is_one or is_decimation_key(key)


def is_scale_of(key: str, column: str) -> bool:
    """Return whether a key that stands beside columns may name a scale of this one: `gain_x`."""
    own = set(words_of(column)) - _FILLERS
    rest = [word for word in words_of(key) if word not in own]
    return bool(own) and own < set(words_of(key)) and (is_scale_key(key) or is_own_scale_key("_".join(rest)))


def is_offset_key(key: str) -> bool:
    """Return whether a key of a scale is that of an offset, which does nothing where it is 0, not 1."""
    return bool(set(words_of(key)) & _OFFSET_WORDS)


def is_fill_key(key: str) -> bool:
    """Return whether a key names the number that stands for a reading that there is not."""
    return "".join(words_of(key)) in _FILLS


def _beside(key: str, known: frozenset[str]) -> set[str] | None:
    """Return the words of a key beside a known one, without those that say nothing; None: it has no known one."""
    words = set(words_of(key))
    return (
        words - known - _FILLERS - {"string", "text", "label", "description", "ni"} if words & known else None
    )
