"""Preisach identification: cell masses by regularised non-negative least squares.

    minimise || F a + M mu - y ||^2 + lambda || L (mu / area) ||^2   over mu >= 0, a free

M are the regressors of the Everett function on a grid (`rtctl.hysteresis.preisach`), F the memoryless columns
(1, v, v^2), L first differences of the density between neighbouring cells: a quasi-static staircase visits only some
minor loops, and where it says nothing the density is continued smoothly. mu >= 0 makes the model monotone.
Reference: X. Tan, J. Baras, IEEE TAC 50(6), 2005 (piecewise constant density, non-negative identification).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from rtctl.hysteresis.preisach import PreisachModel
from rtctl.hysteresis.preisach_regressors import preisach_regressors
from rtctl.kernels import kernel

FloatArray = NDArray[np.float64]


class PreisachFit(NamedTuple):
    """The model and its residual at the given samples (same unit as y)."""

    model: PreisachModel
    residual: FloatArray


def choose_grid(
    v: FloatArray,
    y: FloatArray,
    cells: int,
    *,
    uniform_share: float,
    scored: NDArray[np.bool_] | None = None,
) -> FloatArray:
    """`cells` + 1 nodes over the range of v: dense where y changes most along the data, shape (cells + 1,).

    `uniform_share` = 1 is the textbook's uniform grid. Samples that are not `scored` have no say, nor has the jump
    from one record to the next across them.
    """
    scored = np.ones(len(v), dtype=bool) if scored is None else scored
    low, high = float(v[scored].min()), float(v[scored].max())
    bins = np.linspace(low, high, 401)
    together = scored[1:] & scored[:-1]
    centre, size = 0.5 * (v[1:] + v[:-1])[together], np.abs(np.diff(y))[together]
    change, _ = np.histogram(centre, bins=bins, weights=size)
    density = (1.0 - uniform_share) * change / max(float(change.sum()), 1e-300) + uniform_share / len(change)
    cumulative = np.concatenate(([0.0], np.cumsum(density)))
    return np.interp(np.linspace(0.0, cumulative[-1], cells + 1), cumulative, bins)


def fit_preisach(
    v: FloatArray,
    y: FloatArray,
    scored: NDArray[np.bool_],
    *,
    cells: int,
    smoothness: float = 1e-4,
    uniform_share: float = 0.5,
    sign: float = 1.0,
    memoryless: tuple[bool, bool] = (False, True),
) -> PreisachFit:
    """Identify on samples in time order: v (n,), y (n,), `scored` (n,) false for reset samples.

    `memoryless` switches the linear and the quadratic memoryless term; `sign` = -1 for an output that falls.
    """
    nodes = choose_grid(v, y, cells, uniform_share=uniform_share, scored=scored)
    regressors = preisach_regressors(v, nodes)[scored]
    target, inputs = sign * y[scored], v[scored]
    columns = [np.ones_like(inputs)] + [inputs**k for k, used in zip((1, 2), memoryless, strict=True) if used]
    free = np.stack(columns, axis=1)
    basis, triangle = qr(free, mode="economic")
    projected = regressors - basis @ (basis.T @ regressors)
    remaining = target - basis @ (basis.T @ target)
    gram, right = projected.T @ projected, projected.T @ remaining
    scale = float(np.trace(gram)) / len(gram)
    gram += scale * (smoothness * roughness(nodes) + 1e-9 * np.eye(len(gram)))
    masses = nonnegative_descent(gram, right, 3000, 1e-10)
    free_values = np.linalg.solve(triangle, basis.T @ (target - regressors @ masses))
    residual = sign * (target - free @ free_values - regressors @ masses)
    terms = iter((sign * free_values[1:]).tolist())
    linear, quadratic = (next(terms) if used else 0.0 for used in memoryless)
    model = PreisachModel(
        grid=nodes, mu=masses, sign=sign, c=float(sign * free_values[0]), c1=linear, c2=quadratic
    )
    return PreisachFit(model, residual)


def roughness(nodes: FloatArray) -> FloatArray:
    """L^T L of the differences of cell density between neighbours, in units of the median cell area."""
    widths = np.diff(nodes)
    count = len(widths)
    upper, lower = np.tril_indices(count)
    area = widths[upper] * widths[lower] * np.where(upper == lower, 0.5, 1.0)
    index = np.full((count, count), -1)
    index[upper, lower] = np.arange(len(upper))
    pairs = [
        (index[i, j], index[a, b])
        for i, j in zip(upper, lower, strict=True)
        for a, b in ((i + 1, j), (i, j + 1))
        if a < count and b <= a
    ]
    first, second = np.asarray(pairs).reshape(-1, 2).T
    penalty = np.zeros((len(upper), len(upper)))
    weight = np.median(area) / area
    np.add.at(penalty, (first, first), weight[first] ** 2)
    np.add.at(penalty, (second, second), weight[second] ** 2)
    np.add.at(penalty, (first, second), -weight[first] * weight[second])
    np.add.at(penalty, (second, first), -weight[first] * weight[second])
    return penalty


@kernel
def nonnegative_descent(gram: FloatArray, right: FloatArray, sweeps: int, tolerance: float) -> FloatArray:
    """min 1/2 x'Gx - b'x over x >= 0 by cyclic coordinate descent; G (n, n) positive definite, b (n,)."""
    count = len(right)
    x = np.zeros(count)
    gradient = -right.copy()
    for _ in range(sweeps):
        largest = 0.0
        for i in range(count):
            change = max(0.0, x[i] - gradient[i] / gram[i, i]) - x[i]
            if change != 0.0:
                x[i] += change
                for j in range(count):
                    gradient[j] += change * gram[i, j]
                largest = max(largest, change * change * gram[i, i])
        if largest <= tolerance * tolerance * np.abs(right).max():
            break
    return x
