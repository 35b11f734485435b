"""Answers of an instrument as numbers: readings with their over-range values, entries of the error queue.

SCPI-99 (volume 1, 7.2.1) has 9.9E+37 for a value beyond the range and 9.91E+37 for none at all.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from drivers.scpi.table import Answer
from rtctl.border.errors import DriverError, Fault

INFINITE = 9.9e37
NO_NUMBER = 9.91e37
_RELATIVE = 1e-4
"""Rounding of the two above in an answer of few digits."""
_SEPARATOR = re.compile(r"[,\t]")
LONGEST_SHOWN = 60


class Reading(NamedTuple):
    """A reading; None where the answer has no such field."""

    voltage_V: float | None
    current_A: float | None
    resistance_ohm: float | None
    limited: bool
    """Whether the compliance voltage limits the current."""


def reading_of(text: str, answer: Answer) -> Reading:
    """Return the reading that `text` is. Raises DriverError without the instrument's name."""
    parts = _SEPARATOR.split(text)
    if len(parts) != len(answer.fields):
        raise DriverError(
            Fault.NO_ANSWER,
            f"answered a reading with {shown(text)}, {len(answer.fields)} values were expected "
            f"({', '.join(answer.fields)})",
        )
    numbers = {
        name: _number(name, part, text)
        for name, part in zip(answer.fields, parts, strict=True)
        if name != "unused"
    }
    limited = bool(int(numbers.pop("status", 0.0)) & answer.compliance_bits)
    if not limited:  # in compliance the voltage may be over its range too: the first cause is told
        for name, value in numbers.items():
            _refuse_special(name, value)
    return Reading(numbers.get("voltage"), numbers.get("current"), numbers.get("resistance"), limited)


def error_of(text: str) -> str:
    """Return the entry of an error queue in words; "": the queue is empty. Raises DriverError for no such entry."""
    number, _, words = _split_once(text)
    try:
        code = int(float(number))
    except (ValueError, OverflowError):  # no number, infinite
        raise DriverError(
            Fault.NO_ANSWER, f"answered the error query with {shown(text)}, which begins with no number"
        ) from None
    if code == 0:
        return ""
    message = _SEPARATOR.split(words)[0].strip().strip('"') if "\t" in text else words.strip().strip('"')
    return f"{code} {message}".strip()


def is_off(text: str) -> bool:
    """Return whether an answer to the question for the output says that it is off."""
    try:
        return float(text) == 0.0
    except ValueError:
        return text.strip().upper() in ("OFF", "FALSE")


def shown(text: str) -> str:
    """Return `text` in quotes for a message, cut if it is long."""
    return repr(text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + "...")


def _split_once(text: str) -> tuple[str, str, str]:
    found = _SEPARATOR.search(text)
    return (text, "", "") if found is None else (text[: found.start()], found[0], text[found.end() :])


def _number(name: str, part: str, text: str) -> float:
    try:
        value = float(part)
        if value != value or (name == "status" and abs(value) >= INFINITE):
            raise ValueError
    except ValueError:
        raise DriverError(
            Fault.NO_ANSWER, f"answered a reading with {shown(text)}: {shown(part)} is no number for {name}"
        ) from None
    return value


def _refuse_special(name: str, value: float) -> None:
    """Raise DriverError for a value that stands for none."""
    size = abs(value)
    if abs(size / NO_NUMBER - 1.0) < _RELATIVE:
        raise DriverError(Fault.NOT_FINITE, f"has no {name} to tell ({value:.4g} stands for none)")
    if size >= INFINITE * (1.0 - _RELATIVE):
        raise DriverError(
            Fault.OUT_OF_RANGE,
            f"reads a {name} beyond its range ({value:.4g} stands for that); is the device connected? "
            f"Set a larger driver.{name}_range"
            if name != "resistance"
            else f"reads a resistance beyond its range ({value:.4g} stands for that); is the device connected?",
        )
