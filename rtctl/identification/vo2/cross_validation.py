"""What identified loops are worth on other excitations: each part of the staircases predicted from the others.

The residual of a fit says what its model left of the data that it was fitted to. Loops that are no sum of relays, or
whose staircase visited few minor loops, are further off elsewhere. So the swings (from one reversal to the next) are
left out in turn, the read-out is fitted to the others, and its error there is that of a prediction.

Reference: M. Stone, J. R. Stat. Soc. B 36 (1974) 111.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.vo2.preisach_fit import fit_preisach

FOLDS = 3
"""Parts that are left out in turn."""
CELLS = 24
"""Cells along each field of the fits: more of them cost seconds and predict no better."""
WHOLE_SWING = 0.8
"""Share of the input's range from which a swing is never left out: what no other one reaches cannot be predicted."""
LEAST_SHARE = 0.02
"""Share of the input's range by which a swing has to turn back to be the next one: noise makes no reversals."""


def cross_validate(
    v: FloatArray, y: FloatArray, scored: NDArray[np.bool_], *, cells: int = CELLS
) -> float | None:
    """Return the RMS error of a Preisach read-out on swings that it was not fitted to.

    Args:
        v: (n,) input in time order.
        y: (n,) output.
        scored: (n,) false for reset samples.
        cells: Cells along each field.

    Returns:
        The RMS error in the unit of y; None where there are fewer inner swings than parts.
    """
    width = float(np.ptp(v[scored]))
    swing = number_swings(v, LEAST_SHARE * width)
    spans = np.array([_span(v[scored & (swing == k)]) for k in range(swing.max() + 1)])
    inner = np.flatnonzero((spans > 0.0) & (spans < WHOLE_SWING * width))
    if len(inner) < FOLDS:
        return None
    errors = []
    for part in range(FOLDS):
        left_out = scored & np.isin(swing, inner[part::FOLDS])
        model = fit_preisach(v, y, scored & ~left_out, cells=cells).model
        errors.append((model.simulate(v) - y)[left_out])
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def number_swings(v: FloatArray, least: float) -> NDArray[np.intp]:
    """Return the number (n,) of the swing of each sample, from a reversal by more than `least` to the next one."""
    swing = np.zeros(len(v), dtype=np.intp)
    extreme, rising, number, at = v[0], True, 0, 0
    for k in range(1, len(v)):
        ahead = v[k] - extreme if rising else extreme - v[k]
        if ahead >= 0.0:
            extreme, at = v[k], k
        elif ahead < -least:
            number += 1
            swing[at + 1 : k] = number
            extreme, at, rising = v[k], k, not rising
        swing[k] = number
    return swing


def _span(values: FloatArray) -> float:
    return float(np.ptp(values)) if len(values) else 0.0
