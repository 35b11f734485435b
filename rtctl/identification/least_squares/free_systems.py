"""Solve G x = r among changing sets of free variables, the others being zero; G symmetric and positive definite.

A set is factorised (Cholesky). One that differs from it in few variables is solved for by the same factor: with L of
the base set, added columns A and unit vectors E of the variables that are removed, the Lagrange multipliers of x_E = 0
are further unknowns z,

    [ G_00    G_0A  E ] [ x_0 ]   [ r_0 ]          W = L^-1 [G_0A E],  w = L^-1 r_0
    [ G_A0    G_AA  0 ] [ x_A ] = [ r_A ]    =>    (C - W' W) z = [r_A; 0] - W' w,   x_0 = L^-T (w - W z)
    [ E'      0     0 ] [ y   ]   [ 0   ]          C = blockdiag(G_AA, 0),  z = [x_A; y]

so that k changes cost n^2 k operations instead of n^3 / 3, and a column of W serves all later sets.
Reference: P. Gill, W. Murray, M. Saunders, M. Wright, SIAM J. Sci. Stat. Comput. 11(6), 1990 (Schur complements).
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from rtctl.border.arrays import FloatArray

MOST_CHANGED = 0.125
"""Changed variables relative to those of the base set, beyond which a set is factorised anew."""


class FreeSystems:
    """Solutions among sets of free variables, in the order in which an active-set method asks for them."""

    def __init__(self, gram: FloatArray, right: FloatArray) -> None:
        """Take `gram` (n, n), symmetric and positive definite, and `right` (n,); neither is copied or changed."""
        self._gram, self._right = gram, right
        self._base = np.zeros(len(right), dtype=bool)
        self._places = np.empty(0, dtype=np.intp)
        self._factor = np.empty((0, 0))
        self._forward = np.empty(0)
        self._columns = np.empty((0, 0), order="F")
        self._column_of = np.empty(0, dtype=np.intp)

    def solve(self, free: NDArray[np.bool_]) -> FloatArray:
        """Return x (n,) by the factor at hand where `free` (n,) differs little from its set, else by a new one.

        Raises:
            numpy.linalg.LinAlgError: The part of `gram` is not positive definite.
        """
        changed = int((free ^ self._base).sum())
        if len(self._places) and changed <= MOST_CHANGED * len(self._places):
            with suppress(np.linalg.LinAlgError):  # round-off, where the variables are as good as dependent
                return self._solve_bordered(free)
        return self.factorise(free)

    def is_factorised(self, free: NDArray[np.bool_]) -> bool:
        """Return whether the factor at hand is that of `free` (n,): then `solve` is as exact as `factorise`."""
        return bool(np.array_equal(free, self._base))

    def factorise(self, free: NDArray[np.bool_]) -> FloatArray:
        """Return x (n,) by a new factor, of the set `free` (n,) itself.

        Raises:
            numpy.linalg.LinAlgError: The part of `gram` is not positive definite.
        """
        self._base, self._places = free.copy(), np.flatnonzero(free)
        if not len(self._places):
            return np.zeros(len(free))
        self._factor = factor_among(self._gram, free)
        self._columns = np.empty((len(self._places), 0), order="F")
        self._column_of = np.full(len(free), -1, dtype=np.intp)
        self._forward = self._half_solved(self._right[self._places])
        x = np.zeros(len(free))
        x[self._places] = lapack.dtrtrs(self._factor, self._forward, lower=1, trans=1)[0]
        return x

    def _solve_bordered(self, free: NDArray[np.bool_]) -> FloatArray:
        added, removed = np.flatnonzero(free & ~self._base), np.flatnonzero(self._base & ~free)
        changed = np.concatenate((added, removed))
        self._extend_columns(changed)
        columns = self._columns[:, self._column_of[changed]]
        complement, right = -(columns.T @ columns), -(columns.T @ self._forward)
        complement[: len(added), : len(added)] += self._gram[np.ix_(added, added)]
        right[: len(added)] += self._right[added]
        further = np.linalg.solve(complement, right)
        x = np.zeros(len(free))
        half = self._forward - columns @ further
        x[self._places] = lapack.dtrtrs(self._factor, half, lower=1, trans=1)[0]
        x[removed], x[added] = 0.0, further[: len(added)]
        return x

    def _extend_columns(self, changed: NDArray[np.intp]) -> None:
        """Make the columns of W that `changed` variables need and that no earlier set needed."""
        new = changed[self._column_of[changed] < 0]
        if not len(new):
            return
        borders = np.zeros((len(self._places), len(new)), order="F")
        outside = ~self._base[new]
        borders[:, outside] = self._gram[np.ix_(self._places, new[outside])]
        borders[np.searchsorted(self._places, new[~outside]), np.flatnonzero(~outside)] = 1.0
        self._column_of[new] = self._columns.shape[1] + np.arange(len(new))
        self._columns = np.asfortranarray(np.hstack((self._columns, self._half_solved(borders))))

    def _half_solved(self, right: FloatArray) -> FloatArray:
        """Return L^-1 `right`."""
        found: FloatArray = lapack.dtrtrs(self._factor, right, lower=1)[0]
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
