"""Turning points of a motion: displacements at which its velocity passes zero, and how many differ."""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.orbits.forced import Drive, Lanes

ROWS_PER_PERIOD = 32
ROUNDED_TO = 0.1
"""Rounding in the paper's unit, mm."""


def turning_points(z: FloatArray, v: FloatArray, step_s: FloatArray) -> list[FloatArray]:
    """Return the turning points of each lane in order of time.

    Between two rows the motion is Hermite's cubic: the error is of the fourth order in the step.

    Args:
        z: (rows, lanes) displacement.
        v: (rows, lanes) velocity.
        step_s: (lanes,) time between rows [s].
    """
    row, lane = np.nonzero(v[:-1] * v[1:] < 0.0)
    order = np.lexsort((row, lane))
    row, lane = row[order], lane[order]
    v0, v1 = v[row, lane], v[row + 1, lane]
    s = _crossing(z[row, lane], z[row + 1, lane], v0 * step_s[lane], v1 * step_s[lane])
    z0, z1 = z[row, lane], z[row + 1, lane]
    h = step_s[lane]
    at = (
        z0 * (1.0 + 2.0 * s) * (1.0 - s) ** 2 + v0 * h * s * (1.0 - s) ** 2
        + z1 * s**2 * (3.0 - 2.0 * s) - v1 * h * s**2 * (1.0 - s)
    )  # fmt: skip
    counts = np.bincount(lane, minlength=z.shape[1])
    return np.split(at, np.cumsum(counts)[:-1])


def _crossing(z0: FloatArray, z1: FloatArray, m0: FloatArray, m1: FloatArray) -> FloatArray:
    """Return where in 0 to 1 the slope of Hermite's cubic is zero: two Newton steps from the chord's zero."""
    s = m0 / (m0 - m1)
    a, b = 6.0 * (z0 - z1) + 3.0 * (m0 + m1), 6.0 * (z1 - z0) - 4.0 * m0 - 2.0 * m1
    for _ in range(2):
        slope = 2.0 * a * s + b
        with np.errstate(invalid="ignore", divide="ignore"):
            moved = s - (a * s * s + b * s + m0) / slope
        s = np.where(np.isfinite(moved), np.clip(moved, 0.0, 1.0), s)
    return s


def turning_points_of(drive: Drive, lanes: Lanes, state: FloatArray, periods: int) -> list[FloatArray]:
    """Return the turning points of each of `lanes` over `periods` from `state` (lanes, 2)."""
    if not lanes.number:
        return []
    motion = drive.march(lanes, state, periods, ROWS_PER_PERIOD)
    return turning_points(motion.displacement, motion.velocity, 1.0 / (lanes.frequency_hz * ROWS_PER_PERIOD))


def different(points: FloatArray, rounded_to: float = ROUNDED_TO) -> int:
    """Return the number of different turning points after rounding."""
    return len(np.unique(np.rint(points / rounded_to)))
