"""Preisach identification: cell masses by regularised non-negative least squares.

    minimise || F a + M mu - y ||^2 + lambda || L (mu / area) ||^2   over mu >= 0, a free

M are the regressors of the Everett function on a grid (`rtctl.hysteresis.preisach.corners`), F the memoryless columns
(1, v, v^2), L second differences of the density between neighbouring cells: a quasi-static staircase visits only some
minor loops, and where it says nothing the density is continued smoothly. mu >= 0 makes the model monotone. lambda is
the largest that generalised cross-validation finds worth it: with n samples and d degrees of freedom of the fit the
error on samples that took no part is predicted as sqrt(n) || residual || / (n - d).
References: X. Tan, J. Baras, IEEE TAC 50(6), 2005 (piecewise constant density, non-negative identification);
G. Golub, M. Heath, G. Wahba, Technometrics 21(2), 1979 (generalised cross-validation).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from rtctl.border.arrays import FloatArray
from rtctl.hysteresis.preisach.corners import CornerRows, corner_rows
from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.identification.least_squares.free_systems import factor_among
from rtctl.identification.least_squares.nonnegative import nonnegative_least_squares

SMOOTHNESS = (1e-1, 1e-2, 1e-3, 1e-4)
"""Values of lambda that are tried, relative to the mean square of the regressors."""
MIN_ERROR_RATIO = 0.97
"""Ratio of predicted errors that less smoothness has to reach to be accepted."""
RIDGE = 1e-9
"""Ridge relative to the mean square of the regressors: a mass that no sample and no neighbour determines is 0."""
AXIS_WEIGHT = 0.1
"""Weight of the density's second differences along the switching fields, beside those along their mean.

Films vary more smoothly with where a loop lies than with how wide it is.
"""


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
    """Return nodes (cells + 1,) over the range of v, dense where y changes most along the data.

    Args:
        v: (n,) input.
        y: (n,) output.
        cells: Number of cells.
        uniform_share: Share of cells that is spread uniformly; 1 is the textbook's uniform grid.
        scored: (n,) samples that count; nor does the jump across the others, from one record to the next.
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


# ten parameters because the data are three arrays and the seven options are independent, with defaults
def fit_preisach(  # noqa: PLR0913
    v: FloatArray,
    y: FloatArray,
    scored: NDArray[np.bool_],
    *,
    cells: int = 0,
    nodes: FloatArray | None = None,
    near: PreisachModel | None = None,
    smoothness: float | None = None,
    uniform_share: float = 0.6,
    sign: float = 1.0,
    memoryless: tuple[bool, bool] = (False, True),
) -> PreisachFit:
    """Identify a Preisach model on samples in time order.

    Args:
        v: (n,) input.
        y: (n,) output.
        scored: (n,) false for reset samples.
        cells: Number of cells of the grid that `choose_grid` makes where `nodes` is None.
        nodes: (cells + 1,) grid.
        near: Model whose empty cells are the first guess of the empty ones; it changes the time, not the fit.
        smoothness: lambda; None: by generalised cross-validation.
        uniform_share: Share of uniform cells of the chosen grid.
        sign: -1 for an output that falls.
        memoryless: Whether there are a linear and a quadratic memoryless term.
    """
    if nodes is None:
        nodes = choose_grid(v, y, cells, uniform_share=uniform_share, scored=scored)
    rows = corner_rows(v, nodes, scored)
    target, inputs = sign * y[scored], v[scored]
    columns = [np.ones_like(inputs)] + [inputs**k for k, used in zip((1, 2), memoryless, strict=True) if used]
    free = np.stack(columns, axis=1)
    basis, triangle = np.linalg.qr(free)
    start = None if near is None else _masses_at(near, nodes)
    masses = _fit_masses(rows, basis, target, build_roughness(nodes), smoothness, start)
    left = target - rows.of(masses)
    free_values = np.linalg.solve(triangle, basis.T @ left)
    residual = sign * (left - free @ free_values)
    terms = iter((sign * free_values[1:]).tolist())
    linear, quadratic = (next(terms) if used else 0.0 for used in memoryless)
    model = PreisachModel(
        grid=nodes, mu=masses, sign=sign, c=float(sign * free_values[0]), c1=linear, c2=quadratic
    )
    return PreisachFit(model, residual)


def _masses_at(model: PreisachModel, nodes: FloatArray) -> FloatArray:
    """Return the masses of `model` in the cells in which the middles of the cells of the grid `nodes` lie."""
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    cells = np.clip(np.searchsorted(model.grid, middles) - 1, 0, len(model.grid) - 2)
    upper, lower = np.tril_indices(len(middles))
    i, j = cells[upper], cells[lower]
    found: FloatArray = model.mu[i * (i + 1) // 2 + j]
    return found


# six parameters because the fit is one of rows to a target, beside a basis, smooth to a degree, from a start
def _fit_masses(  # noqa: PLR0913
    rows: CornerRows, basis: FloatArray, target: FloatArray, rough: FloatArray, smoothness: float | None,
    start: FloatArray | None,
) -> FloatArray:  # fmt: skip
    """Return the masses of the cells beside what the orthonormal columns of `basis` (samples, m) explain."""

    def less(series: FloatArray) -> FloatArray:
        """Remove the part along the basis."""
        found: FloatArray = series - basis @ (basis.T @ series)
        return found

    along, remaining = rows.against(basis), less(target)
    gram = rows.gram()
    gram -= along @ along.T
    right = rows.against(remaining[:, None])[:, 0]
    scale = float(np.trace(gram)) / len(gram)
    masses, least = None, np.inf
    for weight in SMOOTHNESS if smoothness is None else (smoothness,):
        regular = gram + (scale * weight) * rough
        regular[np.diag_indices(len(gram))] += scale * RIDGE
        found = nonnegative_least_squares(regular, right, start if masses is None else masses)
        if smoothness is not None:
            return found
        error = _predict_error(gram, regular, found, remaining - less(rows.of(found)), basis.shape[1])
        if masses is not None and not error < MIN_ERROR_RATIO * least:
            break
        masses, least = found, error
    assert masses is not None
    return masses


def _predict_error(
    gram: FloatArray, regular: FloatArray, masses: FloatArray, residual: FloatArray, fitted: int
) -> float:
    """Return the RMS error predicted for new samples by generalised cross-validation among the non-empty cells.

    `fitted` other unknowns were estimated from the same samples.
    """
    free, count = masses > 0.0, len(residual)
    freedom = float(fitted)
    if free.any():
        freedom += _trace_of_solution(factor_among(regular, free), gram[np.ix_(free, free)])
    return float(np.sqrt(count) * np.linalg.norm(residual) / (count - freedom)) if count > freedom else np.inf


def _trace_of_solution(factor: FloatArray, right: FloatArray) -> float:
    """Return trace(A^-1 B) of symmetric A (n, n), given its Cholesky factor, and B (n, n): no solution is needed."""
    inverse = lapack.dpotri(factor, lower=1, overwrite_c=1)[0]  # its lower triangle
    below = np.tril_indices(len(right), -1)
    return float(np.diagonal(inverse) @ np.diagonal(right) + 2.0 * (inverse[below] @ right[below]))


def build_roughness(nodes: FloatArray) -> FloatArray:
    """Return L' L of second differences of cell density, in units of the median cell area.

    Differences are taken along both switching fields, and along their mean (cells diagonally next to each other).
    """
    widths = np.diff(nodes)
    count = len(widths)
    upper, lower = np.tril_indices(count)
    area = widths[upper] * widths[lower] * np.where(upper == lower, 0.5, 1.0)
    index = np.full((count + 2, count + 2), -1)
    index[upper + 1, lower + 1] = np.arange(len(upper))
    weight = np.median(area) / area
    penalty = np.zeros((len(upper), len(upper)))
    for step, share in (((1, 0), AXIS_WEIGHT), ((0, 1), AXIS_WEIGHT), ((1, 1), 1.0)):
        before, after = (index[upper + 1 + s * step[0], lower + 1 + s * step[1]] for s in (-1, 1))
        inside = (before >= 0) & (after >= 0)
        cells = (before[inside], np.flatnonzero(inside), after[inside])
        for a, one in zip(cells, (1.0, -2.0, 1.0), strict=True):
            for b, other in zip(cells, (1.0, -2.0, 1.0), strict=True):
                np.add.at(penalty, (a, b), share * one * other * weight[a] * weight[b])
    return penalty
