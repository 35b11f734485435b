"""Least squares whose normal equations are an arrow: shared unknowns, and each segment's own ones.

    [ S  B^T ] [ step_shared ]     [ g_shared ]        S (p, p), B (K q, p),
    [ B  T   ] [ step_own    ] = - [ g_own    ]        T block tridiagonal, blocks (q, q)

Segments are coupled to the next one at most (continuity), so T is a band matrix: its elimination costs as much as
there are segments, not their cube, and the Schur complement S - B^T T^-1 B is what the data say of the shared
unknowns when the own ones are nobody's business.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solveh_banded

from rtctl.border.arrays import FloatArray

LEAST_DIAGONAL = 1e-14


class NormalEquations(NamedTuple):
    """Of K segments with q own unknowns each and p shared ones; `cost` is half the sum of squares."""

    cost: float
    shared: FloatArray
    """(p, p)"""
    shared_gradient: FloatArray
    """(p,)"""
    border: FloatArray
    """(K, q, p)"""
    diagonal: FloatArray
    """(K, q, q)"""
    next: FloatArray
    """(K - 1, q, q): rows of segment k, columns of segment k + 1."""
    local_gradient: FloatArray
    """(K, q)"""


def make_zero_equations(p: int, segments: int, q: int) -> NormalEquations:
    """All zeros, to add to."""
    return NormalEquations(
        0.0, np.zeros((p, p)), np.zeros(p), np.zeros((segments, q, p)), np.zeros((segments, q, q)),
        np.zeros((max(segments - 1, 0), q, q)), np.zeros((segments, q)),
    )  # fmt: skip


def solve_step(
    equations: NormalEquations, damping: float, frozen: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Marquardt's step of the shared (p,) and own (K, q) unknowns; `frozen` (p,) shared ones stay.

    Raises LinAlgError where the damped equations are not positive definite.
    """
    count, q, p = equations.border.shape
    kept = np.flatnonzero(~frozen)
    shared = equations.shared[np.ix_(kept, kept)]
    shared = shared + np.diag(_damped_diagonal(np.diag(shared), damping))
    moved = np.zeros(p)
    if count * q == 0:
        moved[kept] = -_solve(shared, equations.shared_gradient[kept])
        return moved, np.zeros((count, q))
    border = equations.border.reshape(count * q, p)[:, kept]
    gradient = equations.local_gradient.reshape(-1)
    inner = solveh_banded(_band(equations, damping), np.column_stack((border, gradient)))
    schur = shared - border.T @ inner[:, :-1]
    moved[kept] = -_solve(schur, equations.shared_gradient[kept] - border.T @ inner[:, -1])
    own = -(inner[:, -1] + inner[:, :-1] @ moved[kept])
    return moved, own.reshape(count, q)


def eliminate_local(equations: NormalEquations) -> tuple[FloatArray, FloatArray]:
    """Schur complement (p, p): information on the shared unknowns alone; and T^-1 B (K, q, p)."""
    count, q, p = equations.border.shape
    if count * q == 0:
        return equations.shared, np.zeros((count, q, p))
    border = equations.border.reshape(count * q, p)
    inner = solveh_banded(_band(equations, 1e-12), border)
    return equations.shared - border.T @ inner, inner.reshape(count, q, p)


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    if len(right) == 0:
        return right
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    lower = np.linalg.cholesky(matrix * scale[:, None] * scale)  # raises LinAlgError
    solved: FloatArray = scale * np.linalg.solve(lower.T, np.linalg.solve(lower, scale * right))
    return solved


def _damped_diagonal(diagonal: FloatArray, damping: float) -> FloatArray:
    floor = LEAST_DIAGONAL * max(float(diagonal.max(initial=0.0)), 1e-300)
    added: FloatArray = damping * diagonal + floor
    return added


def _band(equations: NormalEquations, damping: float) -> FloatArray:
    """T in the upper form of `solveh_banded`, its diagonal damped."""
    count, q = equations.local_gradient.shape
    width = 2 * q - 1
    band = np.zeros((width + 1, count * q))
    columns = np.arange(count) * q
    for i in range(q):
        for j in range(i, q):
            band[width - (j - i), columns + j] = equations.diagonal[:, i, j]
        for j in range(q):
            band[width - (q + j - i), columns[1:] + j] = equations.next[:, i, j]
    band[width] += _damped_diagonal(band[width], damping)
    return band


__all__ = ["LinAlgError", "NormalEquations", "eliminate_local", "make_zero_equations", "solve_step"]
