"""Mean and square root of the covariance by cubature points, as kernels on flat arrays: row after row, no LAPACK.

A covariance P = L L' is carried as its lower triangular root L, which never becomes indefinite and loses half as many
digits, so that single precision serves as well. States are in units of their standard deviation at the start, readings
in units of their noise.

Reference: I. Arasaratnam, S. Haykin, IEEE Trans. Automatic Control 54 (2009) 1254, section V (square-root filter).
"""

from __future__ import annotations

import math

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel


@kernel
def triangularise(a: FloatArray, n: int, root: FloatArray) -> None:
    """Fill `root` (n * n,) with the lower triangular L of L L' = A A', A (n, columns) in `a`, by modified Gram-Schmidt.

    The rows of `a` are left orthogonal.
    """
    columns = a.size // n
    for i in range(n):
        total = 0.0
        for k in range(columns):
            total += a[i * columns + k] * a[i * columns + k]
        length = math.sqrt(total)
        for j in range(n):
            root[i * n + j] = root[i * n + j] if j < i else 0.0
        root[i * n + i] = length
        if length > 0.0:
            for k in range(columns):
                a[i * columns + k] = a[i * columns + k] / length
        for j in range(i + 1, n):
            total = 0.0
            for k in range(columns):
                total += a[j * columns + k] * a[i * columns + k]
            root[j * n + i] = total
            for k in range(columns):
                a[j * columns + k] -= total * a[i * columns + k]


@kernel
def solve_triangular(root: FloatArray, n: int, b: FloatArray, x: FloatArray) -> None:
    """Fill `x` (n,) with the solution of L L' x = b for a lower triangular L (n * n,)."""
    for i in range(n):
        total = b[i]
        for k in range(i):
            total -= root[i * n + k] * x[k]
        x[i] = total / root[i * n + i]
    for j in range(n):
        i = n - 1 - j
        total = x[i]
        for k in range(i + 1, n):
            total -= root[k * n + i] * x[k]
        x[i] = total / root[i * n + i]


# 6 parameters because a compiled kernel takes its arrays one by one
@kernel
def spread_points(
    x: FloatArray, root: FloatArray, scale: FloatArray, low: FloatArray, high: FloatArray, points: FloatArray
) -> None:
    """Fill `points` (2n * n,) with x +- sqrt(n) times the columns of L, within the limits.

    Args:
        x: Mean (n,) [SI].
        root: Root of the covariance (n * n,) [scale].
        scale: Units (n,) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        points: See above.
    """
    n = x.size
    width = math.sqrt(float(n))
    for i in range(n):
        for j in range(n):
            size = width * scale[i] * root[i * n + j]
            points[j * n + i] = min(max(x[i] + size, low[i]), high[i])
            points[(n + j) * n + i] = min(max(x[i] - size, low[i]), high[i])


# 7 parameters because a compiled kernel takes its arrays one by one
@kernel
def take_moments(  # noqa: PLR0913
    points: FloatArray, scale: FloatArray, added: FloatArray, elapsed_s: float, x: FloatArray, root: FloatArray,
    wide: FloatArray,
) -> None:  # fmt: skip
    """Fill `x` (n,) and `root` (n * n,) with mean and root of the covariance of points, and of what rates miss.

    Args:
        points: States (2n * n,) [SI].
        scale: Units (n,) of the root [SI].
        added: Root of the spectral density (n,) of what the rates miss [scale/s^(1/2)].
        elapsed_s: Time that it acted [s].
        x: See above.
        root: See above.
        wide: Room for numbers (n * 3n,).
    """
    n, count = x.size, 2 * x.size
    columns = count + n
    share, acted = 1.0 / math.sqrt(float(count)), math.sqrt(elapsed_s)
    for i in range(n):
        total = 0.0
        for j in range(count):
            total += points[j * n + i]
        x[i] = total / count
        for j in range(count):
            wide[i * columns + j] = share * ((points[j * n + i] - x[i]) / scale[i])
        for j in range(n):
            wide[i * columns + count + j] = added[i] * acted if j == i else 0.0
    triangularise(wide[0 : n * columns], n, root)
