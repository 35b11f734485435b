"""Readings cut off by a sensor, told from those of a device that rests at the end of its travel.

A motion that goes beyond what a sensor reads arrives at the last reading with speed and leaves it with speed; one that
comes to rest there slows down before and begins slowly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray

LEAST_SPEED = 0.1
"""Speed before and after a run of equal readings, over the median speed of the motion, from which it was cut off: a
sine cut off at 99 % of its amplitude has 0.2, an axis with a servo drive that comes to rest (EMPS) 0.01."""
LEAST_STEP = 10.0
"""Median step of the motion in resolutions of the reading (its step or its noise), over the samples from which its
speed is taken."""
LONGEST_SPAN = 0.02
"""Most of a record over which a speed is taken."""
ONE_LEVEL = 1.5
"""Resolutions that a reading at rest may flicker by."""
FOURTH_OF_NOISE = 0.6745 * math.sqrt(70.0)
"""Median magnitude of the fourth differences of white noise of one, 1 -4 6 -4 1."""
SLOWING, MOST_SPEED = 0.05, 0.5
"""Share of the range in which a device slows down to rest; largest speed that is asked for because of this.

Within r of its place of rest it is still at sqrt(r / slowing distance) of its speed, and r is known to a few
resolutions.
"""


class Plateau(NamedTuple):
    """Rows `first` to `end`, without the latter, at the extreme of a record, where readings were cut off."""

    first: int
    end: int


def find_cut_off(values: FloatArray) -> list[Plateau]:
    """Return the runs of readings (n,) at exactly their largest value that the motion reaches and leaves with speed.

    Runs that are parted by readings one level or the noise below are one.
    """
    levels = np.unique(values)
    if len(levels) < 3:
        return []
    largest, resolution = levels[-1], max(float(np.diff(levels).min()), _noise(values))
    span = _span(values, resolution)
    least = _least_speed(resolution / float(np.ptp(levels))) * _usual_step(values, span)
    found = []
    for first, end in _runs(values >= largest - ONE_LEVEL * resolution):
        at = first + np.flatnonzero(values[first:end] == largest)
        if len(at) and _is_cut_off(values, first, end, span, least):
            found.append(Plateau(int(at[0]), int(at[-1]) + 1))
    return found


def _least_speed(resolution: float) -> float:
    """Return the share of the usual speed that cut off readings have at least; resolution as a share of the range."""
    return min(max(LEAST_SPEED, math.sqrt(2.0 * ONE_LEVEL * resolution / SLOWING)), MOST_SPEED)


def _is_cut_off(values: FloatArray, first: int, end: int, span: int, least: float) -> bool:
    """Return whether the motion changes by `least` in `span` samples before row `first` and after row `end` - 1.

    The sample beside them is passed over: a part of its step is cut off. An end of the record says nothing.
    """
    before, after = first - 1 - span, end + span
    is_fast = [
        abs(values[inside] - values[outside]) >= least
        for inside, outside in ((first, before), (end - 1, after))
        if 0 <= outside < len(values)
    ]
    return bool(is_fast) and all(is_fast)


def _noise(values: FloatArray) -> float:
    """Return the standard deviation of white noise, by fourth differences, of which a smooth motion has hardly any."""
    differences = np.abs(np.diff(values, 4))
    moving = differences[differences > 0.0]
    return float(np.median(moving)) / FOURTH_OF_NOISE if moving.size else 0.0


def _span(values: FloatArray, resolution: float) -> int:
    """Return over how many samples the motion goes on by several resolutions."""
    span = 1
    while 2 * span <= LONGEST_SPAN * len(values) and _usual_step(values, span) < LEAST_STEP * resolution:
        span *= 2
    return span


def _usual_step(values: FloatArray, span: int) -> float:
    """Return the median change over `span` samples where the readings change at all."""
    steps = np.abs(values[span:] - values[:-span])
    moving = steps[steps > 0.0]
    return float(np.median(moving)) if moving.size else 0.0


def _runs(there: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[int, int]]:
    """Return first row and end of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
