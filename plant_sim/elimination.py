"""Small linear systems within kernels."""

from __future__ import annotations

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel


@kernel
def solve_in_place(matrix: FloatArray, rhs: FloatArray) -> None:
    """Solve matrix (n, n) times unknown = rhs (n,) by elimination with pivots; both are overwritten."""
    n = matrix.shape[0]
    for c in range(n):
        best = c
        for r in range(c + 1, n):
            if abs(matrix[r, c]) > abs(matrix[best, c]):
                best = r
        if best != c:
            for k in range(n):
                kept = matrix[c, k]
                matrix[c, k] = matrix[best, k]
                matrix[best, k] = kept
            kept = rhs[c]
            rhs[c] = rhs[best]
            rhs[best] = kept
        for r in range(c + 1, n):
            factor = matrix[r, c] / matrix[c, c]
            for k in range(c, n):
                matrix[r, k] -= factor * matrix[c, k]
            rhs[r] -= factor * rhs[c]
    for r in range(n - 1, -1, -1):
        for k in range(r + 1, n):
            rhs[r] -= matrix[r, k] * rhs[k]
        rhs[r] /= matrix[r, r]
