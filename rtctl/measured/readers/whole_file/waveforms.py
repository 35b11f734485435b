"""Waveforms as oscilloscopes save them: counts of a converter in a group, beside them their scale and sample period.

Of counts c: value = increment (c - reference) + origin. Keysight calls them YInc and YOrg, SCPI's preamble (IEEE 488.2
instruments) YINCrement, YREFerence and YORigin, Tektronix YMULT, YOFF and YZERO.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.measured.readers.stated.attributes import numbers_of, text_of
from rtctl.measured.readers.stated.beside import MOST_NUMBERS, Level
from rtctl.measured.readers.stated.rate import RateKey, period_of
from rtctl.measured.readers.table import Column, Header, Table, length

_SCALES = (("yinc", "yorg", ""), ("yincrement", "yorigin", "yreference"), ("ymult", "yzero", "yoff"))
"""Keys of increment, origin and reference."""
_PERIODS, _STARTS = ("xinc", "xincr", "xincrement"), ("xorg", "xorigin", "xzero")
_TIME_UNITS, _UNITS = ("xunits", "xunit"), ("yunits", "yunit")
_DISPLAYED = frozenset({"xdisprange", "ydisprange"})
"""Keys of what the screen showed, which scales nothing."""
_PERIOD = RateKey("xinc", "", is_rate=False)


class _Scale(NamedTuple):
    increment: float
    origin: float
    reference: float
    text: str

    def readings(self, counts: Column) -> Column:
        """Return the values of counts."""
        return np.asarray(self.increment * (counts.astype(np.float64) - self.reference) + self.origin)


def with_waveforms(table: Table) -> Table:
    """Return the table with the readings of waveforms that are counts, their periods and starts."""
    headers, scales = dict(table.columns), dict[str, _Scale]()
    for path, level in table.beside.items():
        told = {key.lower().replace("_", ""): key for key in level}
        for name in _waveforms(table, path):
            headers[name] = _timed(headers[name], told, level)
            scale = _scale(told, level)
            unit = next((text_of(level[told[key]]) for key in _UNITS if key in told), "") if scale else ""
            headers[name] = headers[name]._replace(unit=headers[name].unit or unit or None)
            if scale is not None and _are_counts(table, name):
                scales[name] = scale
                headers[name] = headers[name]._replace(dtype=np.dtype(np.float64))
    if headers == table.columns:
        return table

    def load(name: str, first: int, end: int) -> Column:
        stored = table.load(name, first, end)
        return scales[name].readings(stored) if name in scales else stored

    beside = {
        path: {key: told for key, told in level.items() if key.lower() not in _DISPLAYED}
        for path, level in table.beside.items()
    }
    named = ", ".join(f'"{name}" ({scale.text})' for name, scale in scales.items())
    remarks = (f"counts of a converter, read as their group says: {named}",) if scales else ()
    remarks = (*table.remarks, *remarks)
    return replace(table, columns=headers, load=load, load_together=None, remarks=remarks, beside=beside)


def _waveforms(table: Table, path: str) -> list[str]:
    """Return the columns of a group that are its waveforms: the only one, or those that are called data."""
    arrays = [
        name
        for name, one in table.columns.items()
        if (table.place(name).groups or ("",))[-1] == path
        and not one.refusal
        and max(one.shape, default=0) > MOST_NUMBERS
    ]
    return arrays if len(arrays) == 1 else [name for name in arrays if name.lower().endswith("data")]


def _number(told: Mapping[str, str], level: Level, *keys: str) -> float | None:
    """Return the one finite number that stands under one of the keys; None: there is none."""
    for key in keys:
        try:
            numbers = numbers_of(level[told[key]]) if key in told else np.empty(0)
        except (ValueError, TypeError):
            continue
        if len(numbers) == 1 and np.isfinite(numbers[0]):
            return float(numbers[0])
    return None


def _scale(told: Mapping[str, str], level: Level) -> _Scale | None:
    for keys in _SCALES:
        increment, origin = (_number(told, level, key) for key in keys[:2])
        if increment and origin is not None:
            reference = _number(told, level, keys[2]) or 0.0
            text = ", ".join(f"{told[key]} = {_number(told, level, key):g}" for key in keys if key in told)
            return _Scale(increment, origin, reference, text)
    return None


def _timed(header: Header, told: Mapping[str, str], level: Level) -> Header:
    """Return a header with the period [s] and the start [s] of its group, where the group's x is a time."""
    step = _number(told, level, *_PERIODS)
    unit = next((text_of(level[told[key]]) for key in _TIME_UNITS if key in told), "")
    period_s = None if step is None else period_of(_PERIOD, step, unit)
    if step is None or period_s is None or header.period_s is not None or not (unit or _scale(told, level)):
        return header
    key = next(told[key] for key in _PERIODS if key in told)
    start = _number(told, level, *_STARTS)
    header = header._replace(period_s=period_s, period_key=f'by "{key}" of its group')
    if start is None or header.start_s is not None:
        return header
    start_key = next(told[key] for key in _STARTS if key in told)
    return header._replace(start_s=start * period_s / step, start_key=start_key)


def _are_counts(table: Table, name: str) -> bool:
    """Return whether numbers are counts: integers, or whole numbers in floating point that are not all 0."""
    header = table.columns[name]
    if header.dtype is not None and header.dtype.kind in "iu":
        return True
    try:
        values = table.load(name, 0, length(header.shape))
    except ValueError:
        return False
    if values.dtype.kind in "iu":
        return True
    return values.dtype.kind == "f" and bool(np.any(values)) and bool(np.all(values == np.round(values)))
