"""Classification of motions: in one well, through both, chaotic, or chaotic for a while.

The bistable beam's paper classifies by turning points after 100 s: all of one sign, in one well; fewer than 20
different ones after rounding to 0.1 mm, through both; else chaotic. `by_rule` keeps that. Beside it stand the final
period of the motion (stroboscopic map) and whether neighbours diverge before it has settled (Lyapunov): a motion whose
neighbours diverge at the look and that settles later is transient chaos, which the rule calls chaos.
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
"""Least exponent [1/s] of chaos: over 200 periods a regular motion with the beam's damping stays below it."""
LOOK_PERIODS = 128
"""Drive periods over which turning points of an unsettled motion are counted."""


class Kind(StrEnum):
    """Kind of a motion."""

    INTRAWELL = "intrawell"
    INTERWELL = "interwell"
    CHAOTIC = "chaotic"
    TRANSIENT_CHAOS = "transient_chaos"
    UNSETTLED = "unsettled"
    """The motion neither repeats nor diverges from its neighbours in the given time."""
    UNBOUNDED = "unbounded"


class Patience(NamedTuple):
    """Times for which motions are followed."""

    look_s: float
    """Time [s] when the rule is applied and the exponent of unsettled motions is measured: the paper's 100 s."""
    most_s: float
    """Longest time [s] that a motion is followed."""
    rounded_to: float = ROUNDED_TO


class Orbits(NamedTuple):
    """Result of the classification of each lane."""

    kind: list[Kind]
    by_rule: list[Kind]
    """Kind by the paper's rule at the look."""
    period: IntArray
    """Period in drive periods; 0: none found, -1: unbounded."""
    settled_s: FloatArray
    """Time [s] after which the motion had settled; NaN if it did not."""
    exponent: FloatArray
    """Lyapunov exponent [1/s] at the look of what had not settled; NaN for the rest."""
    state: FloatArray
    """Final state (lanes, 2) at a crest of the drive."""
    points: list[FloatArray]
    """Turning points of the orbit, or of `LOOK_PERIODS` periods of an unsettled motion."""


def classify(drive: Drive, lanes: Lanes, start: FloatArray, patience: Patience) -> Orbits:
    """Follow every lane from `start` (lanes, 2) and classify it."""
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
    """Classify turning points by the paper's rule."""
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
    """Classify a motion that repeats: in one well, or through both."""
    return Kind.INTRAWELL if (points > 0.0).all() or (points < 0.0).all() else Kind.INTERWELL


def _points(drive: Drive, lanes: Lanes, state: FloatArray, period: IntArray) -> list[FloatArray]:
    """Return turning points of one orbit each, or of `LOOK_PERIODS`."""
    found: list[FloatArray] = [np.empty(0)] * lanes.number
    for length in np.unique(period).tolist():
        if length < 0:
            continue
        chosen: IntArray = np.flatnonzero(period == length)
        of_these = turning_points_of(drive, lanes.of(chosen), state[chosen], length or LOOK_PERIODS)
        for lane, points in zip(chosen.tolist(), of_these, strict=True):
            found[lane] = points
    return found
