"""The instant of a column's first sample that its attributes state: `t0 = 0.004`, `start_time = "2026-11-28T10:00"`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rtctl.measured.readers.stated.attributes import numbers_of, text_of

_OFFSETS = re.compile(
    r"(?:t0|tzero|tstart|timestart|timezero|(?:wf)?startoffset|timeoffset)(?P<unit>s|ms|us|ns)?"
)
_DATES = re.compile(r"(?:wf)?start(?:time|date|datetime|timestamp)")
_EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Sizes from which a number counts ns, us or ms since 1970."""
_FACTORS = {None: 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


class Start(NamedTuple):
    """When a column begins."""

    start_s: float
    """Time [s] from an origin that the columns of a file share: their zero, or 1970."""
    key: str
    """Keys that state it."""


def stated_start(attributes: Mapping[str, Any]) -> Start | None:
    """Return when a column begins, an offset beside a date added to it; None: its attributes do not say."""
    total, keys = 0.0, []
    for key, value in attributes.items():
        if key.startswith("T0"):
            continue  # a temperature
        plain = re.sub(r"[\W_]+", "", key.lower())
        offset = _OFFSETS.fullmatch(plain)
        seconds = _number(value) if offset else _instant(value) if _DATES.fullmatch(plain) else None
        if seconds is not None:
            total += seconds * (_FACTORS[offset["unit"]] if offset else 1.0)
            keys.append(key)
    return Start(total, ", ".join(keys)) if keys else None


def _number(value: Any) -> float | None:
    try:
        numbers = numbers_of(value)
    except (ValueError, TypeError):
        return None
    return float(numbers[0]) if len(numbers) == 1 and np.isfinite(numbers[0]) else None


def _instant(value: Any) -> float | None:
    """Return a date as seconds since 1970, or a number of seconds as it is; None: it is neither."""
    text = text_of(value)
    if not text:
        number = _number(value)
        return (
            number
            if number is None
            else number * next((unit for low, unit in _EPOCHS if abs(number) >= low), 1.0)
        )
    try:
        instant = np.datetime64(re.sub(r"(Z|[+-]\d\d:?\d\d)$", "", text.strip()).replace(" ", "T"), "ns")
    except ValueError:
        return None
    return None if np.isnat(instant) else float(instant.astype(np.int64)) * 1e-9
