"""Units of an amplitude, as analysers write them: peak, RMS and peak-to-peak values, and decibels of a reference.

An amplitude is held as its peak value A, of A cos(2 pi f t): A = sqrt(2) rms = (peak-to-peak) / 2. A level L [dB] of an
amplitude is 20 lg(A / A0), with A0 the reference (IEC 60027-3).
"""

from __future__ import annotations

import math
import re
from typing import Literal, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray

Convention = Literal["", "peak", "rms", "peak-to-peak"]
TO_PEAK: dict[Convention, float] = {"": 1.0, "peak": 1.0, "rms": math.sqrt(2.0), "peak-to-peak": 0.5}
"""Peak value of a sine for a value of 1; what nobody states is taken as a peak."""
_CONVENTIONS: dict[Convention, str] = {
    "peak-to-peak": r"p-?p|pk-?pk|pkpk|pk-p|peak[- ]to[- ]peak|peak[- ]peak",
    "rms": r"rms|eff",
    "peak": r"(?:0-)?(?:pk|peak)|0-p",
}
_BEHIND = re.compile(
    r"(?P<unit>.*?[^\W_])[\s_(-]*(?P<words>"
    + "|".join(f"(?:{one})" for one in _CONVENTIONS.values())
    + r")[\s)]*",
    re.IGNORECASE,
)
"""A unit with a convention behind it: `V pk`, `Vrms`, `um (p-p)`."""
_PEAK_OF = re.compile(r"(?P<unit>[mkunµμ]?[VA])(?P<words>p)")
"""`Vp`: a single p is a peak behind volts and amperes only."""
_CONVENTION_IN_NAME = re.compile(
    r"(?:^|[\W_])(?P<words>" + "|".join(f"(?:{one})" for one in _CONVENTIONS.values()) + r")(?=$|[\W_])",
    re.IGNORECASE,
)
_DECIBEL = re.compile(r"\s*(?:dB|db|DB|decibels?)(?P<rest>(?![a-z]).*|[muµμ]?V.*|[mu]|)", re.DOTALL)
_REFERENCE = re.compile(
    r"[\s,)\]]*[\[(]?\s*(?:(?:re|rel|ref)\b\.?:?\s*)?(?P<number>\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)?\s*(?P<unit>[^\d\s)\]].*?)?"
    r"\s*[)\]]*\s*"
)
_DECIBEL_AT_END = re.compile(
    r"(?:^|[^A-Za-z])(?P<level>dB(?![A-Za-z]).*|dB[muµμ]?V\w*|dB[mu])$"
    r"|(?:mag\w*|amp\w*|gain|level|response|abs)[\s_]+(?P<lower>db)$"
)
"""Decibels at the end of a name without brackets: `Mag dB re 1 um`, `gain_dB`, `mag_db`; `u_db` may be a dead band."""


_LOGARITHM = re.compile(r"(?:^|[^A-Za-z])(?:log_?10|log2|(?:log|ln|lg)(?=[(|]))(?![A-Za-z])", re.IGNORECASE)
"""A logarithm in a name: `log10 R`, `ln(R)`, `20*log10|H|`; `log.u` and `log_u` are what a logger wrote."""


class AmplitudeUnit(NamedTuple):
    """What one number of a column of amplitudes means."""

    unit: str
    """Unit in the words of the file; "": decibels of a reference that nobody states."""
    reference: float = 1.0
    """Amplitude [unit] of 0 dB."""
    convention: Convention = ""
    is_level: bool = False
    """Whether the numbers are decibels."""

    def peak(self, values: FloatArray) -> FloatArray:
        """Return the peak values (n,) [unit] of the amplitudes or levels (n,) of a column."""
        if self.is_level:
            values = self.reference * 10.0 ** (np.asarray(values) / 20.0)
        return np.ascontiguousarray(TO_PEAK[self.convention] * values, dtype=np.float64)

    @property
    def text(self) -> str:
        """Unit as a manifest has it: `um rms`, `dB re 20 um`."""
        behind = f" {self.convention}" if self.convention else ""
        if not self.is_level:
            return f"{self.unit}{behind}"
        return f"dB re {self.reference:.9g} {self.unit}{behind}" if self.unit else "dB"


def amplitude_unit(text: str) -> AmplitudeUnit | None:
    """Return the amplitude that a unit's text means; None: it is a plain unit, or none at all."""
    if (level := _DECIBEL.fullmatch(text)) is not None:
        return _level(level["rest"])
    found = _PEAK_OF.fullmatch(text.strip()) or _BEHIND.fullmatch(text.strip())
    if found is None or not any(letter.isalpha() for letter in found["unit"]):
        return None
    return AmplitudeUnit(found["unit"].strip(), convention=_convention(found["words"]))


def is_level(text: str | None) -> bool:
    """Return whether a unit's text is a logarithm, which no sum and no product of a signal can hold."""
    found = amplitude_unit(text) if text else None
    return found is not None and found.is_level


def level_at_end(name: str) -> str | None:
    """Return the decibels that a column's name ends with, without brackets; None: it has none."""
    found = _DECIBEL_AT_END.search(name.strip())
    return None if found is None else (found["level"] or found["lower"]).strip()


def is_named_logarithm(name: str) -> bool:
    """Return whether a column's name says that its numbers are a logarithm: `log10(R)`, `ln(R)`."""
    return _LOGARITHM.search(name) is not None


def convention_in_name(name: str) -> Convention:
    """Return the convention that a column's name has among its words: `Drive RMS [V]`; "": none."""
    found = _CONVENTION_IN_NAME.search(name)
    return _convention(found["words"]) if found else ""


def without_convention(name: str) -> str:
    """Return a column's name without the words of a convention: `Amplitude RMS` as `Amplitude`."""
    return _CONVENTION_IN_NAME.sub("", name).strip(" _,") or name


def _convention(words: str) -> Convention:
    for convention, pattern in _CONVENTIONS.items():
        if re.fullmatch(pattern, words, re.IGNORECASE):
            return convention
    return "peak"


def _level(rest: str) -> AmplitudeUnit:
    """Return decibels by what stands behind `dB`: `V` (of 1 V RMS, by its definition), ` re 1 um`, `(m/s)`."""
    volts = re.fullmatch(r"(?P<unit>[muµμ]?V)[\s_]*(?P<words>rms|pk|peak|p)?", rest, re.IGNORECASE)
    if volts is not None and not rest[:1].isspace():
        words = volts["words"]
        return AmplitudeUnit(volts["unit"], 1.0, _convention(words) if words else "rms", is_level=True)
    found = _REFERENCE.fullmatch(rest)
    if found is None or not found["unit"] or rest[:1].isalpha():
        return AmplitudeUnit("", is_level=True)
    unit = found["unit"].strip()
    reference = float(found["number"]) if found["number"] else 1.0
    behind = amplitude_unit(unit)
    if behind is not None and not behind.is_level:
        return AmplitudeUnit(behind.unit, reference, behind.convention, is_level=True)
    return AmplitudeUnit(unit, reference, is_level=True)
