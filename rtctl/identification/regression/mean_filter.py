"""The beam paper's mean filter: over 21 samples, ten neighbours to each side.

Reference: the bistable beam paper, sections 2.3 and 3.2 (filter of order 20).
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

NEIGHBOURS = 10


def apply_mean_filter(signal: FloatArray, neighbours: int = NEIGHBOURS) -> FloatArray:
    """Return the mean over `neighbours` on both sides, (n - 2 neighbours,)."""
    total = np.cumsum(np.concatenate(([0.0], signal)))
    width = 2 * neighbours + 1
    averaged: FloatArray = (total[width:] - total[:-width]) / width
    return averaged
