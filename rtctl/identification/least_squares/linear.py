"""Linear least squares with some coefficients free and some non-negative: the inner problem of every fit here.

    minimise || F a + W p - y ||^2   over a free, p >= 0

The free part is projected out by QR, the rest is non-negative least squares on the triangular factor, so the cost
after the QR does not depend on the number of samples.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from rtctl.border.arrays import FloatArray


class LinearFit(NamedTuple):
    """Coefficients of the free (a) and the non-negative (p) columns, and the residual y - F a - W p."""

    free: FloatArray
    nonnegative: FloatArray
    residual: FloatArray


def fit_partly_nonnegative(free: FloatArray, nonnegative: FloatArray, y: FloatArray) -> LinearFit:
    """Solve the problem above.

    Args:
        free: (n, q) columns with coefficients of any sign; q of a few tens at most.
        nonnegative: (n, m) columns with coefficients >= 0; m of a few tens at most.
        y: (n,) target.
    """
    q_free, r_free = qr(free, mode="economic")
    projected = nonnegative - q_free @ (q_free.T @ nonnegative)
    target = y - q_free @ (q_free.T @ y)
    scale = np.linalg.norm(projected, axis=0)
    scale[scale <= 1e-12 * np.linalg.norm(nonnegative, axis=0)] = np.inf  # inside the free span: weight 0
    q_small, r_small = qr(projected / scale, mode="economic")
    # scipy's nnls ends the process where there are no columns
    weights = nnls(r_small, q_small.T @ target)[0] / scale if len(scale) else np.empty(0)
    coefficients = solve_triangular(r_free, q_free.T @ (y - nonnegative @ weights))
    residual = y - free @ coefficients - nonnegative @ weights
    return LinearFit(coefficients, weights, residual)
