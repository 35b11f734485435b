"""The amplitude of the drive of a sweep, where no column has it: said, in the file's words, or in the file's name.

Instruments write the level of a sweep into a comment (`% demod 1, drive 20 mV pk`) or into the name of the file
(`dev1_sweep_020mV.csv`). A level is taken where each of the files states exactly one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.border.errors import InputError
from rtctl.measured.amplitude_unit import AmplitudeUnit
from rtctl.measured.proposal.naming.column_units import quantity_of, unit_of_amplitude
from rtctl.measured.proposal.survey import Survey
from rtctl.measured.stated_unit import readable, stated_amplitude
from rtctl.measured.units import convert_column

SAID = "you said so"
IN_WORDS, IN_NAME = "the file's words", "the file's name"
_NUMBER = r"(?<![\w.,])(?P<number>\d+(?:[.,p]\d+)?(?:[eE][+-]?\d+)?)"
_QUANTITY = re.compile(
    _NUMBER + r"[ _-]?(?P<unit>[^\W\d_]+(?:[/^*][\w^]+)*(?:[ _-]?(?:rms|pp|pkpk|p-p|pk|peak|p))?)"
)
_OF_DRIVE = re.compile(r"drive|driv|excit|anreg|stimul|source|osc\w*|output|\bV_?ac\b|\bU_?ac\b|generator|shaker|level|"
                       r"amplitude|pegel|amplitud", re.IGNORECASE)  # fmt: skip
_OTHER_LEVELS = re.compile(
    r"sens|range|full.?scale|limit|noise|gain|bias|offset|dc\b|threshold", re.IGNORECASE
)
"""Words for levels of something else."""
_CONVENTIONS = (1.0, 2.0, 0.5, math.sqrt(2.0), math.sqrt(0.5))
"""Ratios of two statements of one level of which one does not say whether it is a peak, peak-to-peak or RMS value."""
_UNSURE_IN_NAMES = frozenset({"A", "N", "T", "m"})
"""Letters behind a number in a name that are more often part of a word: `sample_2A`."""


class DriveLevel(NamedTuple):
    """Amplitude of the drive of one file."""

    amplitude: float
    """Peak value [unit]."""
    unit: str
    stated: str
    """As it is written."""
    source: str
    has_convention: bool
    """Whether it is stated to be a peak, peak-to-peak or RMS value."""

    @property
    def why(self) -> str:
        """What a comment in the manifest says of it."""
        return self.source if self.source == SAID else f'"{self.stated}" in {self.source}'


def find_levels(surveys: Sequence[Survey], said: str | None) -> list[DriveLevel] | None:
    """Return the level of the drive of each file, all in one unit; None: nobody tells it of every file.

    Raises:
        InputError: What was said is no amplitude of a drive.
    """
    if said is not None:
        return [_said(said)] * len(surveys)
    told = []
    for find in (_in_words, _in_name):
        found = [find(survey) for survey in surveys]
        levels = [one for one in found if one is not None]
        if len(levels) == len(found) and (in_one := _in_one_unit(levels)):
            told.append(in_one)
    if len(told) == 2 and not all(map(_agree, *told)):
        return None
    return told[0] if told else None


def in_unit(levels: Sequence[DriveLevel] | None, unit: str) -> list[DriveLevel] | None:
    """Return levels in the unit of a response per drive; None: there are none, or they are of another quantity.

    Raises:
        InputError: What was said is of another quantity.
    """
    if not levels:
        return None
    found = _in_one_unit([levels[0]._replace(amplitude=1.0, unit=unit), *levels])
    if found is None and levels[0].source == SAID:
        raise InputError(f'--drive-amplitude "{levels[0].stated}": the response is given per {unit}')
    return None if found is None else found[1:]


def doubts_about_levels(levels: Sequence[DriveLevel]) -> list[str]:
    """Return what should be looked at of levels that nobody said."""
    first = levels[0]
    if first.source == SAID:
        return []
    kind = "" if first.has_convention else ", taken as peak values"
    told = ", ".join(dict.fromkeys(one.stated for one in levels))
    return [f"drive: the amplitudes of the sweeps stand in {first.source}: {told}{kind}"]


def _said(text: str) -> DriveLevel:
    found = _QUANTITY.fullmatch(text.strip())
    level = None if found is None else _level(found, SAID, any_quantity=True)
    if level is None:
        raise InputError(
            f'--drive-amplitude "{text}": is no amplitude; write a number above 0 and its unit, such as "20 mV" or '
            '"20 mV rms"'
        )
    return level


def _in_words(survey: Survey) -> DriveLevel | None:
    """Return the one level that lines above the columns state with a word for the drive; None: none or several."""
    found: set[DriveLevel] = set()
    for text in survey.texts.values():
        for part in re.split(r"[;,\t|]\s|\t", text):
            if _OF_DRIVE.search(part) and not _OTHER_LEVELS.search(part):
                found |= {level for one in _QUANTITY.finditer(part) if (level := _level(one, IN_WORDS))}
    return found.pop() if len(found) == 1 else None


def _in_name(survey: Survey) -> DriveLevel | None:
    """Return the one level in the name of the file, or of its group; None: none or several."""
    stem = Path(survey.path.name).stem
    for name in (survey.group or "", stem):
        words = name.replace("_", " ")
        if _OTHER_LEVELS.search(words):
            continue
        shown = [one for one in _QUANTITY.finditer(words) if one["unit"] not in _UNSURE_IN_NAMES]
        found = {level for one in shown if (level := _level(one, IN_NAME))}
        if len(found) == 1:
            return found.pop()
    return None


def _level(found: re.Match[str], source: str, *, any_quantity: bool = False) -> DriveLevel | None:
    text = found["unit"].strip(" _-")
    amplitude = stated_amplitude(text) or (AmplitudeUnit(text) if readable(text) else None)
    number = float(re.sub("[,p]", ".", found["number"]))
    if amplitude is None or amplitude.is_level or not amplitude.unit or not number > 0.0:
        return None
    unit = unit_of_amplitude(amplitude.unit)
    quantity = quantity_of(unit) if unit else "none"
    if quantity in ("none", "time") or not (any_quantity or quantity in ("drive", "current")):
        return None
    peak = float(amplitude.peak(np.array([number]))[0])
    return DriveLevel(peak, unit, found[0].strip(" _"), source, amplitude.convention != "")


def _agree(one: DriveLevel, other: DriveLevel) -> bool:
    """Return whether two levels are one, or differ by a convention that one of them does not state."""
    try:
        value = float(convert_column(np.array([other.amplitude]), other.unit, one.unit)[0])
    except ValueError:
        return False
    ratios = (1.0,) if one.has_convention and other.has_convention else _CONVENTIONS
    return any(math.isclose(one.amplitude, ratio * value, rel_tol=0.01) for ratio in ratios)


def _in_one_unit(levels: Sequence[DriveLevel]) -> list[DriveLevel] | None:
    """Return levels in the unit of the first one; None: they are of several quantities."""
    unit = levels[0].unit
    try:
        return [
            one._replace(
                amplitude=float(convert_column(np.array([one.amplitude]), one.unit, unit)[0]), unit=unit
            )
            for one in levels
        ]
    except ValueError:
        return None
