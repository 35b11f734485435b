"""Non-negative least squares from the normal equations, by block principal pivoting.

    minimise 1/2 x' G x - b' x   over x >= 0,   G positive definite

The set of zeros is guessed and the others are solved for exactly; all variables that then have the wrong sign (x < 0,
or a gradient by which a zero should grow) change sides at once, or one by one where that stops helping. A handful of
factorisations gives the optimum itself, where coordinate descent is far from it after thousands of sweeps if
neighbouring columns are similar. Reference: L. Portugal, J. Judice, L. Vicente, Mathematics of Computation 63(208),
1994.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular
from scipy.optimize import nnls

from rtctl.border.arrays import FloatArray

MAX_FACTORISATIONS = 300
"""Factorisations before the slow method that never fails is used."""
PATIENCE = 4
"""Exchanges of whole blocks without fewer wrong signs, before single variables are exchanged."""
RELATIVE_ROUND_OFF = 1e-11
"""Magnitude relative to the largest below which a value has no sign."""


def nonnegative_least_squares(
    gram: FloatArray, right: FloatArray, start: FloatArray | None = None
) -> FloatArray:
    """Return the x (n,) >= 0 that minimises 1/2 x' gram x - right' x.

    Args:
        gram: (n, n) positive definite matrix.
        right: (n,) right-hand side.
        start: (n,) solution of a similar problem; its zeros are the first guess.

    Raises:
        numpy.linalg.LinAlgError: `gram` is not positive definite.
    """
    free = np.zeros(len(right), dtype=bool) if start is None else start > 0.0
    fewest, patience = len(right) + 1, PATIENCE
    for _ in range(MAX_FACTORISATIONS):
        x = np.zeros(len(right))
        if free.any():
            x[free] = lapack.dpotrs(factor_among(gram, free), right[free], lower=1)[0]
        gradient = gram @ x - right
        wrong = free & (x < -RELATIVE_ROUND_OFF * np.abs(x).max(initial=0.0))
        wrong |= ~free & (gradient < -RELATIVE_ROUND_OFF * np.abs(right).max(initial=0.0))
        count = int(wrong.sum())
        if not count:
            return np.maximum(x, 0.0)
        if count < fewest:
            fewest, patience = count, PATIENCE
        elif patience:
            patience -= 1
        else:  # the one of the highest index: that cannot go round in circles
            wrong[: np.flatnonzero(wrong)[-1]] = False
        free ^= wrong
    lower = np.linalg.cholesky(gram)
    found: FloatArray = nnls(lower.T, solve_triangular(lower, right, lower=True))[0]
    return found


def factor_among(gram: FloatArray, free: NDArray[np.bool_]) -> FloatArray:
    """Return the Cholesky factor of the rows and columns of `gram` (n, n) that are `free` (n,), in its lower triangle.

    It is for LAPACK alone: what stands above the diagonal has no meaning, and nothing is checked or copied twice.

    Raises:
        numpy.linalg.LinAlgError: That part is not positive definite.
    """
    part = gram[np.ix_(free, free)]
    factor, failed = lapack.dpotrf(part.T, lower=1, clean=0, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError(f"the leading minor of order {failed} is not positive definite")
    found: FloatArray = factor
    return found
