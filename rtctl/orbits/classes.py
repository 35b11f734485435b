"""Which kind of motion it is: in one well, through both, chaotic, or chaotic for a while.

The bistable beam's paper tells by turning points after 100 s: all of one sign, in one well; fewer than 20 different
ones after rounding to 0.1 mm, through both; else chaotic. That is kept, as `by_rule`. Beside it stand what the motion
does in the end (the stroboscopic map's period) and whether neighbours part while it has not settled (Lyapunov): a
motion that parts from its neighbours at the look and settles later is transient chaos, for which the rule says chaos.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.orbits.forced import Drive, Lanes
from rtctl.orbits.lyapunov import lyapunov
from rtctl.orbits.settling import settle
from rtctl.orbits.turning_points import ROUNDED_TO, different, turning_points_of

FEWER_THAN = 20
EXPONENT_PERIODS = 200
CHAOS_LEAST = 0.1
"""Least exponent [1/s] of chaos: over 200 periods a regular motion of the beam's damping stays below it."""
LOOK_PERIODS = 128
"""Over which turning points of an unsettled motion are counted."""


class Kind(StrEnum):
    """Of motion."""

    INTRAWELL = "intrawell"
    INTERWELL = "interwell"
    CHAOTIC = "chaotic"
    TRANSIENT_CHAOS = "transient_chaos"
    UNSETTLED = "unsettled"
    """Neither repeats nor parts from its neighbours in the time that it was given."""
    UNBOUNDED = "unbounded"


class Patience(NamedTuple):
    """How long motions are followed."""

    look_s: float
    """When the rule is applied and an exponent measured of what has not settled: the paper's 100 s."""
    most_s: float
    """In all."""
    rounded_to: float = ROUNDED_TO


class Orbits(NamedTuple):
    """What became of each lane."""

    kind: list[Kind]
    by_rule: list[Kind]
    """By the paper's rule at the look."""
    period: IntArray
    """In periods of the drive; 0: none found, -1: without bound."""
    settled_s: FloatArray
    """NaN: not."""
    exponent: FloatArray
    """At the look of what had not settled [1/s]; NaN of the rest."""
    state: FloatArray
    """(lanes, 2) at a crest of the drive at the end."""
    points: list[FloatArray]
    """Turning points: of the orbit, or of so many periods of what does not settle."""


def classify(drive: Drive, lanes: Lanes, start: FloatArray, patience: Patience) -> Orbits:
    """Follow every lane from `start` (lanes, 2) and say what it is."""
    look = np.ceil(patience.look_s * lanes.frequency_hz).astype(np.int64)
    most = np.ceil(patience.most_s * lanes.frequency_hz).astype(np.int64)
    early = settle(drive, lanes, start, look)
    state, period, after = early.state.copy(), early.period.copy(), early.after_periods.copy()
    exponent = np.full(lanes.number, np.nan)
    open_ones: IntArray = np.flatnonzero(period == 0)
    looked: dict[int, FloatArray] = {}
    if len(open_ones):
        chosen = lanes.of(open_ones)
        looked = dict(
            zip(open_ones.tolist(), turning_points_of(drive, chosen, state[open_ones], LOOK_PERIODS), strict=True)
        )  # fmt: skip
        exponent[open_ones], moved = lyapunov(drive, chosen, state[open_ones], EXPONENT_PERIODS)
        late = settle(drive, chosen, moved, np.maximum(most[open_ones] - after[open_ones], 1))
        state[open_ones], period[open_ones] = late.state, late.period
        after[open_ones] += late.after_periods + EXPONENT_PERIODS
    points = _points(drive, lanes, state, period)
    by_rule = [rule(looked.get(lane, points[lane]), patience.rounded_to) for lane in range(lanes.number)]
    kinds = [
        _kind(int(period[lane]), float(exponent[lane]), points[lane]) for lane in range(lanes.number)
    ]  # fmt: skip
    settled_s = np.where(period > 0, after / lanes.frequency_hz, np.nan)
    return Orbits(kinds, by_rule, period, settled_s, exponent, state, points)


def rule(points: FloatArray, rounded_to: float = ROUNDED_TO) -> Kind:
    """The paper's."""
    if not len(points) or not np.isfinite(points).all():
        return Kind.UNBOUNDED if len(points) else Kind.UNSETTLED
    if (points > 0.0).all() or (points < 0.0).all():
        return Kind.INTRAWELL
    return Kind.INTERWELL if different(points, rounded_to) < FEWER_THAN else Kind.CHAOTIC


def _kind(period: int, exponent: float, points: FloatArray) -> Kind:
    if period < 0:
        return Kind.UNBOUNDED
    if period == 0:
        return Kind.CHAOTIC if exponent > CHAOS_LEAST else Kind.UNSETTLED
    if exponent > CHAOS_LEAST:
        return Kind.TRANSIENT_CHAOS
    return regular(points)


def regular(points: FloatArray) -> Kind:
    """Of a motion that repeats: in one well, or through both."""
    return Kind.INTRAWELL if (points > 0.0).all() or (points < 0.0).all() else Kind.INTERWELL


def _points(drive: Drive, lanes: Lanes, state: FloatArray, period: IntArray) -> list[FloatArray]:
    """Turning points of one orbit each, or of `LOOK_PERIODS`."""
    found: list[FloatArray] = [np.empty(0)] * lanes.number
    for length in np.unique(period).tolist():
        if length < 0:
            continue
        chosen: IntArray = np.flatnonzero(period == length)
        of_these = turning_points_of(drive, lanes.of(chosen), state[chosen], length or LOOK_PERIODS)
        for lane, points in zip(chosen.tolist(), of_these, strict=True):
            found[lane] = points
    return found
