"""Nesting of loops of deflection against resistance: minor loops outside the major one.

The major loop is the sweep down from the highest current to the lowest after it, and the sweep back up.
Nested loops would stay between its two branches D(ln R) (paper, figure 5c).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray


class Outside(NamedTuple):
    """How far and where minor loops leave the major loop; `sample` is the farthest."""

    overshoot_um: float
    sample: int


def leaves_major_loop(
    current_mA: FloatArray, resistance_ohm: FloatArray, deflection_um: FloatArray
) -> Outside | None:
    """Return the sample (n,) farthest outside the major loop; None without a major loop or with all samples inside.

    Samples within 8 % of either end of the range of ln R do not count: there the branches are vertical.
    """
    major = _major_branches(current_mA)
    if major is None:
        return None
    x = np.log(resistance_ohm)
    branches = []
    for branch in major:
        order = branch[np.isfinite(deflection_um[branch])]
        order = order[np.argsort(x[order], kind="stable")]
        if len(order) < 2:
            return None
        branches.append(np.interp(x, x[order], deflection_um[order]))
    above = deflection_um - np.maximum(*branches)
    below = np.minimum(*branches) - deflection_um
    margin = 0.08 * np.ptp(x)
    counted = (x > x.min() + margin) & (x < x.max() - margin)
    outside = np.where(counted & np.isfinite(deflection_um), np.maximum(above, below), -np.inf)
    farthest = int(np.argmax(outside))
    rounding = 1e-9 * float(np.ptp(deflection_um[np.isfinite(deflection_um)]))
    return Outside(float(outside[farthest]), farthest) if outside[farthest] > rounding else None


def _major_branches(current_mA: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
    """Return samples of the widest cooling sweep and of the heating sweep after it; None without both."""
    top = int(np.argmax(current_mA))
    bottom = top + int(np.argmin(current_mA[top:]))
    again = bottom + int(np.argmax(current_mA[bottom:]))
    if not top < bottom < again:
        return None
    return np.arange(top, bottom + 1), np.arange(bottom, again + 1)


def window_around(values: FloatArray, centre: float, share: float) -> tuple[float, float]:
    """Return limits about `centre` that span `share` of the range of `values`."""
    half = 0.5 * share * float(np.nanmax(values) - np.nanmin(values))
    return centre - half, centre + half
