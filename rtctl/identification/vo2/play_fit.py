"""Identification of play models by variable projection.

Outer problem: the envelopes `gamma(v) = tanh((v - c) / w)`, bounded, from several starts. Inner problem: the
weights p >= 0 and the memoryless terms, linear (`fit_partly_nonnegative`). Order preservation gamma_R <= gamma_L
holds by construction: a pair is described by

    theta = (ln m, rho, c, d),  c_R = c + d/2,  c_L = c - d/2,  w_R, w_L = m + d (1 +- rho) / (2 X),
    d >= 0, |rho| <= 1

so the envelopes cross, if at all, where both have saturated: |argument| >= X, 1 - tanh X = 2e-8.
Reference: G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1 (variable projection).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.linalg.lapack import dgeqrf
from scipy.optimize import least_squares

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.play import play
from rtctl.identification.least_squares.linear import LinearFit, fit_partly_nonnegative

PARAMETERS = 4  # of one pair of envelopes
SCREENING_EVALUATIONS = 15
SCREENING_STRIDE = 4
FINALISTS = 2
SATURATED_ARGUMENT = 9.2  # X: 1 - tanh X = 2e-8


class EnvelopePairs(NamedTuple):
    """tanh envelopes of n plays: gamma_R = tanh(a_R v + b_R), gamma_L = tanh(a_L v + b_L); each shape (n,)."""

    a_R: FloatArray
    b_R: FloatArray
    a_L: FloatArray
    b_L: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayProblem:
    """Data and structure of one fit: output y (n,) of input v (n,) in time order."""

    v: FloatArray
    y: FloatArray
    scored: NDArray[np.bool_]
    radii: FloatArray
    common: bool
    """Whether all plays share one pair of envelopes (an analytic inverse exists), or have one each."""
    free: FloatArray
    """Columns (n, q) with coefficients of any sign."""
    nonnegative: FloatArray
    """Further columns (n, m) with non-negative coefficients."""
    least_first_weight: float = 0.0
    """Lower bound of the weight of the radius-zero play (the analytic inverse divides by it)."""

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest scored input."""
        return float(self.v[self.scored].min()), float(self.v[self.scored].max())


class PlayFit(NamedTuple):
    """The best fit of all starts."""

    envelopes: EnvelopePairs
    weights: FloatArray
    free: FloatArray
    nonnegative: FloatArray
    residual: FloatArray


def fit_plays(problem: PlayProblem, starts: list[FloatArray], evaluations: int) -> PlayFit:
    """Solve the outer problem from every start, then the most promising ones to the end.

    The starts are compared on every fourth sample. The first one, which has no scatter, always goes to the end.

    Args:
        problem: Data and structure.
        starts: Theta of one pair each.
        evaluations: Most evaluations of the outer problem in the final descents.
    """
    pairs = 1 if problem.common else len(problem.radii)
    thinned = replace(problem, scored=_thin_scored(SCREENING_STRIDE, problem.scored))
    guesses = [np.resize(start, pairs * PARAMETERS) for start in starts]
    first, *trials = (_descend(thinned, guess, SCREENING_EVALUATIONS) for guess in guesses)
    trials.sort(key=lambda trial: trial[1])
    finals = [_descend(problem, theta, evaluations) for theta, _ in (first, *trials[:FINALISTS])]
    best = min(finals, key=lambda trial: trial[1])[0]
    inner, plays = _solve_inner(problem, _build_columns(problem, best)), len(problem.radii)
    weights = inner.nonnegative[:plays].copy()
    weights[0] += problem.least_first_weight
    return PlayFit(
        compute_envelopes(best, plays), weights, inner.free, inner.nonnegative[plays:], inner.residual
    )


def _descend(problem: PlayProblem, guess: FloatArray, evaluations: int) -> tuple[FloatArray, float]:
    """Return theta and cost after at most `evaluations` evaluations of the outer problem."""
    pairs = 1 if problem.common else len(problem.radii)
    span = problem.range[1] - problem.range[0]
    low, high = _make_bounds(problem, pairs)

    @lru_cache(maxsize=1)  # the solver asks for the residual, then for the Jacobian at the same theta
    def linearised(theta: bytes) -> tuple[FloatArray, FloatArray]:
        columns = _compress(_build_columns(problem, np.frombuffer(theta)))
        inner = _solve_inner(problem, columns)
        return inner.residual, _compute_jacobian(problem, columns, inner)

    def residual(theta: FloatArray) -> FloatArray:
        return linearised(theta.tobytes())[0]

    def jacobian(theta: FloatArray) -> FloatArray:
        return linearised(theta.tobytes())[1]

    result = least_squares(
        residual,
        np.clip(guess, low + 1e-6, high - 1e-6),
        jac=jacobian,
        bounds=(low, high),
        x_scale=np.tile([0.3, 0.5, 0.05 * span, 0.05 * span], pairs),
        ftol=1e-7,
        xtol=1e-7,
        max_nfev=evaluations,
    )
    return result.x, float(result.cost)


def _thin_scored(stride: int, scored: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Keep one in `stride` scored samples, at least a hundred; the plays still see all of them."""
    index = np.flatnonzero(scored)
    kept = np.zeros(len(scored), dtype=bool)
    kept[index[:: max(1, min(stride, len(index) // 100))]] = True
    return kept


def spread_starts(problem: PlayProblem, count: int, seed: int) -> list[FloatArray]:
    """Draw starts around the middle of the output's change, the first without scatter; per play where not common."""
    low, high = problem.range
    v, y = problem.v, problem.y
    together = problem.scored[1:] & problem.scored[:-1]  # not across the jump from one record to the next
    middle, change = 0.5 * (v[1:] + v[:-1])[together], np.abs(np.diff(y))[together] + 1e-12
    rising = np.diff(v)[together] > 0.0
    up, up_width = _locate_change(middle[rising], change[rising])
    down, down_width = _locate_change(middle[~rising], change[~rising])
    centre, gap = 0.5 * (up + down), max(up - down, 0.02 * (high - low))
    width = max(0.5 * (up_width + down_width), 0.02 * (high - low))
    pairs = 1 if problem.common else len(problem.radii)
    draw = np.random.default_rng(seed)
    starts = []
    for index in range(count):
        scatter = 0.0 if index == 0 else 1.0
        offsets = np.linspace(-1.0, 1.0, pairs) if pairs > 1 else np.zeros(1)
        theta = np.empty((pairs, PARAMETERS))
        theta[:, 0] = np.log(width) + scatter * draw.normal(0.0, 0.6, pairs)
        theta[:, 1] = 0.0
        theta[:, 2] = centre + width * (offsets + scatter * draw.normal(0.0, 0.5, pairs))
        theta[:, 3] = gap * np.exp(scatter * draw.normal(0.0, 0.4, pairs))
        starts.append(theta.ravel())
    return starts


def _locate_change(v: FloatArray, change: FloatArray) -> tuple[float, float]:
    centre = float(np.average(v, weights=change))
    return centre, float(np.sqrt(np.average((v - centre) ** 2, weights=change)))


def _make_bounds(problem: PlayProblem, pairs: int) -> tuple[FloatArray, FloatArray]:
    low, high = problem.range
    span = high - low
    one_low = [np.log(0.005 * span), -1.0, low - 0.5 * span, 0.0]
    one_high = [np.log(2.0 * span), 1.0, high + 0.5 * span, 0.5 * span]
    return np.tile(one_low, pairs), np.tile(one_high, pairs)


def compute_envelopes(theta: FloatArray, plays: int) -> EnvelopePairs:
    """Return the envelope coefficients of theta; a single pair is repeated for all plays."""
    ln_width, skew, centre, gap = theta.reshape(-1, PARAMETERS).T
    half_skew = gap / (2.0 * SATURATED_ARGUMENT)
    a_right = 1.0 / (np.exp(ln_width) + half_skew * (1.0 + skew))
    a_left = 1.0 / (np.exp(ln_width) + half_skew * (1.0 - skew))
    b_right, b_left = -a_right * (centre + 0.5 * gap), -a_left * (centre - 0.5 * gap)
    return EnvelopePairs(*(np.resize(part, plays) for part in (a_right, b_right, a_left, b_left)))


class Columns(NamedTuple):
    """Columns of the inner problem and their derivatives by theta; a row is a sample, or a combination of samples."""

    free: FloatArray
    """Free columns (rows, q)."""
    plays: FloatArray
    """Outputs of the plays (rows, n)."""
    nonnegative: FloatArray
    """Further non-negative columns (rows, m)."""
    y: FloatArray
    """Target (rows,)."""
    derivatives: FloatArray
    """Derivatives (rows, n, 4) of each output by the four parameters of its envelopes."""


def _build_columns(problem: PlayProblem, theta: FloatArray) -> Columns:
    """Build columns with one row per scored sample."""
    plays, scored = len(problem.radii), problem.scored
    moved = compute_play_columns(
        problem.v, scored, problem.radii, *_compute_arguments(problem.v, compute_envelopes(theta, plays)),
        *differentiate_envelopes(theta, plays),
    )  # fmt: skip
    outputs, derivatives = moved[:, 0].T, moved[:, 1:].transpose(2, 0, 1)
    return Columns(problem.free[scored], outputs, problem.nonnegative[scored], problem.y[scored], derivatives)


def _compress(columns: Columns) -> Columns:
    """Replace the columns by the R of their joint QR decomposition, which has as many rows as columns.

    Weights, norms and angles follow from products alone, and so does every step of the outer solver. It then
    works on a few tens of rows in the place of thousands of samples.
    """
    rows, n = columns.plays.shape
    moved = columns.derivatives.transpose(1, 2, 0).reshape(-1, rows)
    parts = (columns.free.T, columns.plays.T, columns.nonnegative.T, columns.y[None, :])
    side_by_side = np.concatenate((*parts, moved)).T  # column by column in memory, as LAPACK wants it
    triangle = np.triu(
        dgeqrf(side_by_side, lwork=64 * side_by_side.shape[1], overwrite_a=True)[0][: side_by_side.shape[1]]
    )
    ends = np.cumsum([len(part) for part in parts])
    free, plays, nonnegative, y, derivatives = np.split(triangle, ends, axis=1)
    return Columns(free, plays, nonnegative, y[:, 0], derivatives.reshape(-1, n, PARAMETERS))


def _solve_inner(problem: PlayProblem, columns: Columns) -> LinearFit:
    """Return weights and residual for given envelopes."""
    sloped = np.concatenate((columns.plays, columns.nonnegative), axis=1)
    target = columns.y - problem.least_first_weight * columns.plays[:, 0]
    return fit_partly_nonnegative(columns.free, sloped, target)


def _compute_jacobian(problem: PlayProblem, columns: Columns, inner: LinearFit) -> FloatArray:
    """Return the derivative of the residual (rows, parameters) in Kaufman's form: -P dW p, P off the active columns."""
    plays = len(problem.radii)
    weights = inner.nonnegative[:plays].copy()
    weights[0] += problem.least_first_weight
    moved = -weights[:, None] * columns.derivatives
    moved = moved.sum(axis=1) if problem.common else moved.reshape(len(moved), -1)
    active = [columns.free, columns.plays[:, inner.nonnegative[:plays] > 0.0]]
    active.append(columns.nonnegative[:, inner.nonnegative[plays:] > 0.0])
    basis = qr(np.concatenate(active, axis=1), mode="economic")[0]
    return moved - basis @ (basis.T @ moved)


def differentiate_envelopes(theta: FloatArray, plays: int) -> tuple[FloatArray, FloatArray]:
    """Return shift and stretch (2, 4, plays) with d x / d parameter = shift + stretch x of both arguments x = a v + b.

    Heating edge first; parameters in the order of theta.
    """
    ln_width, skew, _, gap = theta.reshape(-1, PARAMETERS).T
    width, per_gap = np.exp(ln_width), 0.5 / SATURATED_ARGUMENT
    shift, stretch = np.zeros((2, PARAMETERS, len(gap))), np.zeros((2, PARAMETERS, len(gap)))
    for edge, sign in enumerate((1.0, -1.0)):
        a = 1.0 / (width + per_gap * gap * (1.0 + sign * skew))
        stretch[edge] = -a * [width, sign * per_gap * gap, np.zeros_like(gap), per_gap * (1.0 + sign * skew)]
        shift[edge] = -a * np.array([[0.0], [0.0], [1.0], [0.5 * sign]])
    repeated = plays // len(gap)
    return np.tile(shift, repeated), np.tile(stretch, repeated)


def _compute_arguments(v: FloatArray, pairs: EnvelopePairs) -> tuple[FloatArray, FloatArray]:
    """Return x = a v + b of all edges and tanh x, each (2, plays, n); numpy's tanh is vectorised, libm's is not."""
    a, b = np.stack((pairs.a_R, pairs.a_L)), np.stack((pairs.b_R, pairs.b_L))
    x = a[:, :, None] * v + b[:, :, None]
    return x, np.tanh(x)


@kernel
def compute_play_columns(
    v: FloatArray,
    scored: NDArray[np.bool_],
    radii: FloatArray,
    x: FloatArray,
    gamma: FloatArray,
    shift: FloatArray,
    stretch: FloatArray,
) -> FloatArray:
    """Return outputs and derivatives (plays, 1 + 4, scored samples) of plays that start on the cooling branch.

    x, gamma (2, plays, n), shift, stretch (2, 4, plays): arguments and values of the edges, heating first. An
    output that an edge moved keeps the derivative d gamma = (1 - gamma^2) dx of that moment until the next.
    """
    columns = np.empty((len(radii), 1 + PARAMETERS, scored.sum()))
    for j in range(len(radii)):
        w, row = 1.0 + radii[j], 0
        derivative = np.zeros(PARAMETERS)
        for k in range(len(v)):
            if k == 0 or v[k] != v[k - 1]:
                lower, upper = gamma[0, j, k] - radii[j], gamma[1, j, k] + radii[j]
                moved = play(w, lower, upper)
                if moved != w:
                    w, edge = moved, 1 if moved == upper else 0
                    slope = 1.0 - gamma[edge, j, k] ** 2
                    for m in range(PARAMETERS):
                        derivative[m] = slope * (shift[edge, m, j] + stretch[edge, m, j] * x[edge, j, k])
            if scored[k]:
                columns[j, 0, row] = w
                columns[j, 1:, row] = derivative
                row += 1
    return columns
