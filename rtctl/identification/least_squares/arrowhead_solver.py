"""Solver for least squares with arrowhead normal equations: shared unknowns, and local ones of each segment.

    [ S  B^T ] [ step_shared ]     [ g_shared ]        S (p, p), B (K q, p),
    [ B  T   ] [ step_local  ] = - [ g_local  ]        T block tridiagonal, blocks (q, q)

A segment is coupled at most to the next one (continuity), so T is a band matrix: its elimination costs time
proportional to the number of segments, not to their cube. The Schur complement S - B^T T^-1 B is the information on
the shared unknowns after the local ones, which are nuisance parameters, have been eliminated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solveh_banded

from rtctl.border.arrays import FloatArray

LEAST_DIAGONAL = 1e-14


class NormalEquations(NamedTuple):
    """Normal equations of K segments with q local unknowns each and p shared ones."""

    cost: float
    """Half the sum of squared residuals."""
    shared: FloatArray
    """Block S (p, p)."""
    shared_gradient: FloatArray
    """Gradient (p,) by the shared unknowns."""
    border: FloatArray
    """Block B (K, q, p)."""
    diagonal: FloatArray
    """Diagonal blocks of T (K, q, q)."""
    next: FloatArray
    """Off-diagonal blocks of T (K - 1, q, q): rows of segment k, columns of segment k + 1."""
    local_gradient: FloatArray
    """Gradient (K, q) by the local unknowns."""


def make_zero_equations(p: int, segments: int, q: int) -> NormalEquations:
    """Return equations of zeros for `p` shared unknowns and `segments` segments of `q` local ones, to add to."""
    return NormalEquations(
        0.0, np.zeros((p, p)), np.zeros(p), np.zeros((segments, q, p)), np.zeros((segments, q, q)),
        np.zeros((max(segments - 1, 0), q, q)), np.zeros((segments, q)),
    )  # fmt: skip


def solve_step(
    equations: NormalEquations, damping: float, frozen: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Return Marquardt's step of the shared (p,) and local (K, q) unknowns.

    Args:
        equations: Normal equations at the current point.
        damping: Factor of the diagonal that is added to it.
        frozen: (p,) shared unknowns that stay where they are.

    Raises:
        LinAlgError: The damped equations are not positive definite.
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
    """Return the Schur complement (p, p), the information on the shared unknowns alone, and T^-1 B (K, q, p)."""
    count, q, p = equations.border.shape
    if count * q == 0:
        return equations.shared, np.zeros((count, q, p))
    border = equations.border.reshape(count * q, p)
    inner = solveh_banded(_band(equations, 1e-12), border)
    return equations.shared - border.T @ inner, inner.reshape(count, q, p)


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a scaled positive definite system by Cholesky; raise LinAlgError where it is not one."""
    if len(right) == 0:
        return right
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    lower = np.linalg.cholesky(matrix * scale[:, None] * scale)  # raises LinAlgError
    solved: FloatArray = scale * np.linalg.solve(lower.T, np.linalg.solve(lower, scale * right))
    return solved


def _damped_diagonal(diagonal: FloatArray, damping: float) -> FloatArray:
    """Return what damping adds to a diagonal, with a floor against zeros."""
    floor = LEAST_DIAGONAL * max(float(diagonal.max(initial=0.0)), 1e-300)
    added: FloatArray = damping * diagonal + floor
    return added


def _band(equations: NormalEquations, damping: float) -> FloatArray:
    """Return T in the upper form of `solveh_banded`, its diagonal damped."""
    count, q = equations.local_gradient.shape
    width = 2 * q - 1 if count > 1 else q - 1  # LAPACK refuses diagonals beyond the matrix
    band = np.zeros((width + 1, count * q))
    columns = np.arange(count) * q
    for i in range(q):
        for j in range(i, q):
            band[width - (j - i), columns + j] = equations.diagonal[:, i, j]
        for j in range(q if count > 1 else 0):
            band[width - (q + j - i), columns[1:] + j] = equations.next[:, i, j]
    band[width] += _damped_diagonal(band[width], damping)
    return band


__all__ = ["LinAlgError", "NormalEquations", "eliminate_local", "make_zero_equations", "solve_step"]
