"""Follow motions until they repeat: an adaptive transient and the period by the stroboscopic map.

A motion has settled on period p once x(n) and x(n - p) differ by less than a tolerance throughout a whole block of
periods, p the least that does. Lanes that have not settled continue, the others stop: a fixed transient of 100 s is
too short for a tenth of the bistable beam's starts and a hundred times too long for most.

A slow decay nearly repeats, too: at damping d a difference of D over p periods means that
D / (1 - exp(-d p T / 2)) is still to decay, so the tolerance is far below any later criterion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.orbits.forced import Drive, Lanes

TOLERANCE = 1e-6
"""Tolerance relative to the size of the motion."""
LONGEST_PERIOD = 16
CLEARLY = 1e3
"""Least ratio of the difference over fewer periods to that over p periods.

Without it a free oscillation that decays and nearly fits p drive periods would pass for a subharmonic.
"""
BLOCK_PERIODS = 64
ABSURD = 1e100
"""A displacement that only an unbounded model reaches, in any unit."""


class Settled(NamedTuple):
    """Progress of the motions, lane by lane."""

    state: FloatArray
    """State (lanes, 2) at a crest of the drive; NaN for an unbounded motion."""
    period: IntArray
    """Period in drive periods; 0: not settled, -1: unbounded."""
    after_periods: IntArray
    """Number of periods after which that was seen."""


def settle(
    drive: Drive, lanes: Lanes, start: FloatArray, most_periods: IntArray, *, tolerance: float = TOLERANCE
) -> Settled:
    """Follow each of `lanes` from `start` (lanes, 2) until it repeats, for at most `most_periods` (lanes,)."""
    state = start.copy()
    period = np.zeros(lanes.number, np.int64)
    after = np.zeros(lanes.number, np.int64)
    under_way: IntArray = np.flatnonzero(most_periods > 0)
    while len(under_way):
        motion = drive.march(lanes.of(under_way), state[under_way], BLOCK_PERIODS)
        after[under_way] += BLOCK_PERIODS
        state[under_way, 0], state[under_way, 1] = motion.displacement[-1], motion.velocity[-1]
        with np.errstate(invalid="ignore"):
            bounded = np.abs(motion.displacement[-1]) < ABSURD
        speed = 2.0 * np.pi * lanes.frequency_hz[under_way]
        found = repeats(motion.displacement, motion.velocity / speed, tolerance)
        period[under_way] = np.where(bounded, found, -1)
        state[under_way[~bounded]] = np.nan
        going = bounded & (found == 0) & (after[under_way] < most_periods[under_way])
        under_way = under_way[going]
    return Settled(state, period, after)


def repeats(z: FloatArray, w: FloatArray, tolerance: float, clearly: float = CLEARLY) -> IntArray:
    """Return the least period (lanes,) of stroboscopic points; 0 where there is none.

    Args:
        z: (points, lanes) displacement.
        w: (points, lanes) scaled velocity, in the unit of z.
        tolerance: Largest difference of a repetition.
        clearly: Least ratio to the differences over shorter periods.
    """
    found = np.zeros(z.shape[1], np.int64)
    with np.errstate(invalid="ignore"):
        size = np.maximum(np.abs(z), np.abs(w)).max(axis=0)
        nearest = np.full(z.shape[1], np.inf)
        for candidate in range(1, LONGEST_PERIOD + 1):
            apart = np.maximum(
                np.abs(z[candidate:] - z[:-candidate]), np.abs(w[candidate:] - w[:-candidate])
            ).max(axis=0)
            same: NDArray[np.bool_] = (apart <= tolerance * size) & (clearly * apart <= nearest)
            found[same & (found == 0)] = candidate
            nearest = np.minimum(nearest, apart)
    return found
