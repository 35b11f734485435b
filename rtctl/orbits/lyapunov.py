"""Largest Lyapunov exponent by a neighbour that is renormalised once a drive period.

Two motions start 1e-7 of their size apart; each period log(distance / first distance) is their divergence, and the
neighbour is set back along the line between them (G. Benettin et al., Meccanica 15 (1980) 9). Only the largest
exponent is computed: the sum of both is minus the damping.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.orbits.forced import Drive, Lanes

APART = 1e-7
ALIGNING_PERIODS = 20
"""Periods before the average starts: the line between the two turns into the direction of largest growth."""


def lyapunov(drive: Drive, lanes: Lanes, state: FloatArray, periods: int) -> tuple[FloatArray, FloatArray]:
    """Return the exponent (lanes,) [1/s] over `periods` from `state` (lanes, 2), and the state at their end.

    Distances are of displacement and of velocity over the drive's angular frequency.
    """
    scale = np.column_stack([np.ones(lanes.number), 2.0 * np.pi * lanes.frequency_hz])
    size = np.maximum(np.abs(state / scale).max(axis=1), 1e-300)
    apart = APART * size
    offset = np.column_stack([apart, np.zeros(lanes.number)])
    both = Lanes(*(np.concatenate([part, part]) for part in lanes))
    here, grown = state.copy(), np.zeros(lanes.number)
    for turn in range(ALIGNING_PERIODS + periods):
        motion = drive.march(both, np.concatenate([here, here + offset * scale]), 1)
        after = np.column_stack([motion.displacement[-1], motion.velocity[-1]])
        here = after[: lanes.number]
        parted = (after[lanes.number :] - here) / scale
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            distance = np.hypot(parted[:, 0], parted[:, 1])
            if turn >= ALIGNING_PERIODS:
                grown += np.log(distance / apart)
            offset = parted * (apart / distance)[:, None]
    return grown / periods * lanes.frequency_hz, here
