"""Non-negative least squares from the normal equations, by block principal pivoting and an active set.

    minimise 1/2 x' G x - b' x   over x >= 0,   G positive definite

The set of zeros is guessed and the others are solved for exactly; all variables that then have the wrong sign (x < 0,
or a gradient by which a zero should grow) change sides at once. A handful of factorisations gives the optimum itself,
where coordinate descent is far from it after thousands of sweeps if neighbouring columns are similar. Exchanges that
go round in circles end a few wrong signs away from the optimum; from there a feasible descent, whose value falls at
each step, reaches it. References: L. Portugal, J. Judice, L. Vicente, Mathematics of Computation 63(208), 1994 (block
pivoting); C. Lawson, R. Hanson, Solving Least Squares Problems, 1974, chapter 23 (active set).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.least_squares.free_systems import FreeSystems

PATIENCE = 4
"""Exchanges of whole blocks without fewer wrong signs, before the descent that cannot go round in circles."""
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
    systems = FreeSystems(gram, right)
    nearest, fewest, patience = np.zeros(len(right)), len(right) + 1, PATIENCE
    while patience:
        x = systems.solve(free)
        wrong = _has_wrong_sign(gram, right, free, x)
        if not wrong.any() and not systems.is_factorised(free):
            x = systems.factorise(free)  # the optimum by its own factor
            wrong = _has_wrong_sign(gram, right, free, x)
        count = int(wrong.sum())
        if not count:
            return np.maximum(x, 0.0)
        if count < fewest:
            nearest, fewest, patience = x, count, PATIENCE
        else:
            patience -= 1
        free ^= wrong
    return descend_among_feasible(gram, right, np.maximum(nearest, 0.0))


def descend_among_feasible(gram: FloatArray, right: FloatArray, start: FloatArray) -> FloatArray:
    """Return the same optimum by an active set, from `start` (n,) >= 0.

    Zeros that should grow become free together. Free variables whose solution is negative become zero together where
    that lowers the value, else the first ones that reach zero on the way to that solution. The value falls between
    one set of free variables that is solved for exactly and the next, so that none comes twice; where it falls no more,
    only round-off is left.
    """
    x, free, lowest = start, start > 0.0, np.inf
    systems = FreeSystems(gram, right)
    while True:
        solution = systems.solve(free)
        negative = free & _is_negative(solution, solution)
        if negative.any():
            x = _step_towards(gram, right, x, solution, negative)
            free &= ~(negative & (x == 0.0))
            continue
        x = np.maximum(solution, 0.0)
        growing = ~free & _is_negative(gram @ x - right, right)
        value = _value(gram, right, x)
        if not (growing.any() and value < lowest):
            return x if systems.is_factorised(free) else np.maximum(systems.factorise(free), 0.0)
        free, lowest = (x > 0.0) | growing, value


def _step_towards(
    gram: FloatArray, right: FloatArray, x: FloatArray, solution: FloatArray, negative: NDArray[np.bool_]
) -> FloatArray:
    """Return the next feasible point from `x` towards a solution where `negative` variables are not allowed."""
    nearest = np.maximum(solution, 0.0)
    if _value(gram, right, nearest) < _value(gram, right, x):
        return nearest
    shares = np.where(negative, x / np.where(negative, x - solution, 1.0), np.inf)
    share = float(shares.min())
    reached = np.maximum(x + share * (solution - x), 0.0)
    reached[shares == share] = 0.0
    return reached


def _value(gram: FloatArray, right: FloatArray, x: FloatArray) -> float:
    return float(x @ (0.5 * (gram @ x) - right))


def _has_wrong_sign(
    gram: FloatArray, right: FloatArray, free: NDArray[np.bool_], x: FloatArray
) -> NDArray[np.bool_]:
    """Return which variables (n,) should change sides: free ones below 0, and zeros that should grow."""
    found: NDArray[np.bool_] = (free & _is_negative(x, x)) | (~free & _is_negative(gram @ x - right, right))
    return found


def _is_negative(values: FloatArray, scale: FloatArray) -> NDArray[np.bool_]:
    """Return which `values` (n,) are negative beyond round-off, relative to the largest magnitude of `scale`."""
    found: NDArray[np.bool_] = values < -RELATIVE_ROUND_OFF * np.abs(scale).max(initial=0.0)
    return found
