"""Whether a column of times goes on as one is told: evenly at a rate, and together with other times of its file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.proposal.instants.column_time import epoch_unit
from rtctl.measured.proposal.naming.column_names import STRONG
from rtctl.measured.proposal.naming.column_units import quantity_of, read_column
from rtctl.measured.proposal.survey import Column, Survey
from rtctl.measured.stated_unit import time_unit_in_name
from rtctl.measured.units import convert_column, count_s, is_clock

WINDOW = 8
"""Intervals that are looked at together: a stamp that came late is made up for by those after it."""
OFF = 0.75
"""Periods by which they may be off, beside the rounding of the stamps."""
USUAL = 0.9
"""Quantile of what they are off by that shows the rounding: stamps that fall on their last digits have none."""
SAME = 1e-3
"""Relative difference of two intervals up to which they are one."""


class OtherTime(NamedTuple):
    """Another time of a file than the one that is taken."""

    name: str
    later_s: float
    """By how much it is later throughout [s]; NaN: it goes on otherwise."""


def first_uneven_row(time_s: FloatArray, resolution_s: float, rate_hz: float) -> int | None:
    """Return the first row after which stamps (n,) leave an even course of `rate_hz`; None: none does."""
    window = min(WINDOW, len(time_s) - 1)
    passed = np.abs((time_s[window:] - time_s[:-window]) * rate_hz - window)
    rounding = min(2.0 * resolution_s * rate_hz, 4.0 * float(np.quantile(passed, USUAL)))
    far = np.flatnonzero(passed > OFF + rounding)
    if not len(far):
        return None
    steps = np.abs(np.diff(time_s[far[0] : far[0] + window + 1]) * rate_hz - 1.0)
    return int(far[0]) + int(np.argmax(steps))


def other_times(survey: Survey, taken: Column) -> Iterator[OtherTime]:
    """Yield the other columns that are called times, where they are not the same instants as those of one."""
    own_s = _seconds(taken)
    if own_s is None:
        return
    for name, column in survey.columns.items():
        if name == taken.name or column.rows != taken.rows or not _is_called_time(column):
            continue
        found = _compared(own_s, _seconds(column))
        if found is not None:
            yield OtherTime(name, found)


def _compared(own_s: FloatArray, other_s: FloatArray | None) -> float | None:
    """Return by how much other instants are later [s], NaN where they go on otherwise; None: they are the same."""
    if other_s is None:
        return None
    here = np.isfinite(own_s) & np.isfinite(other_s)
    steps, others = np.diff(own_s[here]), np.diff(other_s[here])
    if len(others) < 1 or not np.all(others > 0.0):
        return None  # a time of day within one second, a counter that stands: no time of samples
    period_s = float(np.median(steps))
    late = float(np.median(other_s[here] - own_s[here]))
    if here.sum() < np.isfinite(own_s).sum():
        return np.nan
    if np.abs((other_s - own_s)[here] - late).max() > OFF * period_s:
        return np.nan
    span_s = float(own_s[here][-1] - own_s[here][0])
    return late if SAME * period_s < abs(late) < span_s else None


def _is_called_time(column: Column) -> bool:
    if _has_origin(column):
        return True
    read = read_column(column)
    by_unit = bool(read.unit.text) and quantity_of(read.unit.text) == "time"
    return column.values is not None and (by_unit or read.votes.get("time", 0.0) >= STRONG)


def _has_origin(column: Column) -> bool:
    """Return whether a column holds instants from an origin that it shares with others: stamps of ROS."""
    return column.raw is not None and column.raw.dtype.kind == "m"


def _seconds(column: Column) -> FloatArray | None:
    """Return the numbers of a column of times in seconds; None where it holds none, or nobody knows their unit."""
    if column.raw is not None and _has_origin(column):
        return np.asarray(column.raw / np.timedelta64(1, "s"), dtype=np.float64)
    if column.values is None:
        return None
    if column.unit is not None and is_clock(column.unit):
        return column.values * count_s(column.unit)
    size = float(np.nanmax(np.abs(column.values), initial=0.0))
    unit = read_column(column).unit.text or time_unit_in_name(column.name) or epoch_unit(size) or "s"
    return convert_column(column.values, unit, "s") if quantity_of(unit) == "time" else None
