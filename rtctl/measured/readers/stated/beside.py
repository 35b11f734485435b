"""What stands beside the columns of a file, in a group, in the file or in variables of its own, as plain values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from rtctl.measured.readers.groups import Place
from rtctl.measured.readers.stated.attributes import text_of
from rtctl.measured.readers.stated.keys import says_of_columns

MOST_NUMBERS = 16
"""Numbers of an array that may state something of columns; a longer one is a column."""

_LINE = re.compile(r"[#%;/*!'\"\s]*(?P<key>[^:=\t;,]{1,60}?)[\"']?\s*[:=\t;,](?P<values>.*)")
_QUOTES = "\"' \t"

Level = Mapping[str, Any]
"""Keys and values of a group, or of the file: texts, few numbers, tables of these."""


class Period(NamedTuple):
    """A sample period that stands beside a column."""

    period_s: float
    key: str


def levels_of(values: Mapping[str, Any], places: Mapping[str, Place]) -> dict[str, dict[str, Any]]:
    """Return what stands beside columns by the path of its group, of values by the names of their columns."""
    levels: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        if (kept := plain(value)) is None:
            continue
        place = places.get(name, Place(name))
        path = place.groups[-1] if place.groups else ""
        levels.setdefault(path, {})[place.within(path)] = kept
    return levels


def level_of_lines(lines: Iterable[str]) -> dict[str, Any]:
    """Return what lines above columns say of them, `key: value` or `key<TAB>value<TAB>value`, by key.

    Only keys are kept that may say how numbers are to be read: units, scales, numbers that stand for no reading.
    """
    found: dict[str, Any] = {}
    for line in lines:
        parts = _LINE.fullmatch(line)
        if parts is None or not says_of_columns(parts["key"]):
            continue
        values = [one.strip(_QUOTES) for one in re.split(r"[\t;,]", parts["values"])]
        values = [one for one in values if one]
        if values:
            found[parts["key"].strip(_QUOTES)] = values[0] if len(values) == 1 else values
    return found


def plain(value: Any) -> Any:
    """Return a value that may state something of columns as text, numbers or a table of them; None: it does not."""
    if isinstance(value, Mapping):
        found = {str(key): kept for key, one in value.items() if (kept := plain(one)) is not None}
        return found or None
    if text := text_of(value):
        return text
    numbers = np.asarray(value) if not isinstance(value, str | bytes) else np.empty(0)
    if not 0 < numbers.size <= MOST_NUMBERS:
        return None
    if numbers.dtype.kind in "biuf":
        return numbers.astype(np.float64).reshape(-1)
    texts = [text_of(one) for one in numbers.reshape(-1)]
    return texts if all(texts) else None
