"""The sample rate that attributes of a column, its group or its file state, by one rule for all formats.

A key is read without signs and blanks, and may end with a unit: `sample_rate_Hz`, `Sampling Rate`, `fs`, `dt_ms`. A
text may have the unit too: "2.5 kHz".
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from rtctl.measured.readers.stated.attributes import numbers_of, text_of

_RATES = (
    "samplerate", "samplingrate", "samplefrequency", "samplingfrequency", "samplefreq", "samplingfreq", "abtastrate",
    "abtastfrequenz", "scanrate", "fsamp", "fs",
)  # fmt: skip
_PERIODS = (
    "sampletime", "sampleperiod", "sampleinterval", "samplingtime", "samplingperiod", "samplinginterval", "abtastzeit",
    "deltat", "dt",
)  # fmt: skip
"""Keys of a rate and of a period, without signs and blanks; a unit may follow."""
_FACTORS: dict[str, tuple[float, bool] | None] = {
    "": None, "hz": (1.0, True), "khz": (1e3, True), "mhz": (1e6, True), "sps": (1.0, True), "ss": (1.0, True),
    "s": (1.0, False), "sec": (1.0, False), "seconds": (1.0, False), "ms": (1e-3, False), "us": (1e-6, False),
    "ns": (1e-9, False),
}  # fmt: skip
"""Units with their size in Hz or s, and whether they are of a rate; "" is Hz or s."""


def stated_period(*levels: Mapping[str, Any]) -> tuple[float, str] | None:
    """Return the sample period [s] that attributes state, and under which key; None: none does.

    Args:
        levels: Attributes of the column, of its group, and so on to those of the file: the first that has one counts.
    """
    for attributes in levels:
        for key, value in attributes.items():
            name = re.sub(r"[\W_]+", "", key.lower())
            base = next(
                (
                    one
                    for one in (*_RATES, *_PERIODS)
                    if name.startswith(one) and name[len(one) :] in _FACTORS
                ),
                None,
            )
            period_s = None if base is None else _period_s(base, name[len(base) :], value)
            if period_s is not None:
                return period_s, f'period by "{key}"'
    return None


def _period_s(base: str, unit: str, value: Any) -> float | None:
    """Return the period [s] of a rate or a period; None where the value is no such number, or of another unit."""
    told = re.fullmatch(r"([\d.,eE+-]+)\s*([A-Za-zµμ/]*)", text_of(value)) if text_of(value) else None
    try:
        numbers = numbers_of(told[1].replace(",", ".") if told else value)
    except (ValueError, TypeError):
        return None
    unit = (
        re.sub(r"\W+", "", told[2].lower().replace("µ", "u").replace("μ", "u")) if told and told[2] else unit
    )
    if len(numbers) != 1 or not 0.0 < numbers[0] < np.inf or unit not in _FACTORS:
        return None
    is_rate = base in _RATES
    factor = _FACTORS[unit] or (1.0, is_rate)
    if factor[1] != is_rate:
        return None
    size = float(numbers[0]) * factor[0]
    return 1.0 / size if is_rate else size
