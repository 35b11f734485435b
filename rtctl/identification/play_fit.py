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

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.optimize import least_squares

from rtctl.identification.linear import LinearFit, fit_partly_nonnegative
from rtctl.kernels import kernel

FloatArray = NDArray[np.float64]
PARAMETERS = 4  # of one pair of envelopes
SCREENING_EVALUATIONS = 15
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
    """One pair of envelopes for all plays (an analytic inverse exists), or one each."""
    free: FloatArray
    """Columns with coefficients of any sign, (n, q)."""
    nonnegative: FloatArray
    """Further columns with non-negative coefficients, (n, m)."""
    least_first_weight: float = 0.0
    """Lower bound of the weight of the radius-zero play (the analytic inverse divides by it)."""

    @property
    def range(self) -> tuple[float, float]:
        """Of the input where it is scored."""
        return float(self.v[self.scored].min()), float(self.v[self.scored].max())


class PlayFit(NamedTuple):
    """The best of all starts."""

    envelopes: EnvelopePairs
    weights: FloatArray
    free: FloatArray
    nonnegative: FloatArray
    residual: FloatArray


def fit_plays(problem: PlayProblem, starts: list[FloatArray], evaluations: int) -> PlayFit:
    """Solve the outer problem from every start (theta of one pair each), then the most promising ones to the end."""
    pairs = 1 if problem.common else len(problem.radii)
    low, high = _bounds(problem, pairs)
    guesses = [np.clip(np.resize(start, pairs * PARAMETERS), low + 1e-6, high - 1e-6) for start in starts]
    trials = [_descend(problem, guess, SCREENING_EVALUATIONS) for guess in guesses]
    trials.sort(key=lambda trial: trial[1])
    finals = [_descend(problem, theta, evaluations) for theta, _ in trials[:FINALISTS]]
    best = min(finals, key=lambda trial: trial[1])[0]
    inner, envelopes = _inner(problem, best)
    plays = len(problem.radii)
    weights = inner.nonnegative[:plays].copy()
    weights[0] += problem.least_first_weight
    return PlayFit(envelopes, weights, inner.free, inner.nonnegative[plays:], inner.residual)


def _descend(problem: PlayProblem, guess: FloatArray, evaluations: int) -> tuple[FloatArray, float]:
    """theta and cost after at most so many evaluations of the outer problem."""
    pairs = 1 if problem.common else len(problem.radii)
    span = problem.range[1] - problem.range[0]

    def residual(theta: FloatArray) -> FloatArray:
        return _inner(problem, theta)[0].residual

    def jacobian(theta: FloatArray) -> FloatArray:
        return _jacobian(problem, theta)

    result = least_squares(
        residual,
        guess,
        jac=jacobian,
        bounds=_bounds(problem, pairs),
        x_scale=np.tile([0.3, 0.5, 0.05 * span, 0.05 * span], pairs),
        ftol=1e-7,
        xtol=1e-7,
        max_nfev=evaluations,
    )
    return result.x, float(result.cost)


def spread_starts(problem: PlayProblem, count: int, seed: int) -> list[FloatArray]:
    """Starts around the middle of the output's change, the first without scatter; per play where not common."""
    low, high = problem.range
    v, y = problem.v, problem.y
    together = problem.scored[1:] & problem.scored[:-1]  # not across the jump from one record to the next
    middle, change = 0.5 * (v[1:] + v[:-1])[together], np.abs(np.diff(y))[together] + 1e-12
    rising = np.diff(v)[together] > 0.0
    up, up_width = _middle_and_width(middle[rising], change[rising])
    down, down_width = _middle_and_width(middle[~rising], change[~rising])
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


def _middle_and_width(v: FloatArray, change: FloatArray) -> tuple[float, float]:
    centre = float(np.average(v, weights=change))
    return centre, float(np.sqrt(np.average((v - centre) ** 2, weights=change)))


def _bounds(problem: PlayProblem, pairs: int) -> tuple[FloatArray, FloatArray]:
    low, high = problem.range
    span = high - low
    one_low = [np.log(0.005 * span), -1.0, low - 0.5 * span, 0.0]
    one_high = [np.log(2.0 * span), 1.0, high + 0.5 * span, 0.5 * span]
    return np.tile(one_low, pairs), np.tile(one_high, pairs)


def envelopes_of(theta: FloatArray, plays: int) -> EnvelopePairs:
    """Envelope coefficients of theta; a single pair is repeated for all plays."""
    ln_width, skew, centre, gap = theta.reshape(-1, PARAMETERS).T
    half_skew = gap / (2.0 * SATURATED_ARGUMENT)
    a_right = 1.0 / (np.exp(ln_width) + half_skew * (1.0 + skew))
    a_left = 1.0 / (np.exp(ln_width) + half_skew * (1.0 - skew))
    b_right, b_left = -a_right * (centre + 0.5 * gap), -a_left * (centre - 0.5 * gap)
    return EnvelopePairs(*(np.resize(part, plays) for part in (a_right, b_right, a_left, b_left)))


def _inner(problem: PlayProblem, theta: FloatArray) -> tuple[LinearFit, EnvelopePairs]:
    envelopes = envelopes_of(theta, len(problem.radii))
    plays = play_regressors(problem.v, problem.radii, *envelopes)[problem.scored]
    columns = np.concatenate((plays, problem.nonnegative[problem.scored]), axis=1)
    target = problem.y[problem.scored] - problem.least_first_weight * plays[:, 0]
    return fit_partly_nonnegative(problem.free[problem.scored], columns, target), envelopes


def _jacobian(problem: PlayProblem, theta: FloatArray) -> FloatArray:
    """Derivative of the residual (scored samples, parameters), Kaufman's form: -P dW p, P off the active columns.

    A parameter moves the outputs of its own play only, so each difference costs one play and not a whole fit.
    """
    inner, envelopes = _inner(problem, theta)
    plays, scored = len(problem.radii), problem.scored
    weights = inner.nonnegative[:plays].copy()
    weights[0] += problem.least_first_weight
    outputs = play_regressors(problem.v, problem.radii, *envelopes)[scored]
    active = [problem.free[scored], outputs[:, inner.nonnegative[:plays] > 0.0]]
    active.append(problem.nonnegative[scored][:, inner.nonnegative[plays:] > 0.0])
    basis = qr(np.concatenate(active, axis=1), mode="economic")[0]
    columns = np.zeros((len(outputs), len(theta)))
    for index in range(len(theta)):
        moved = theta.copy()
        step = -1e-6 if theta[index] > 0.0 else 1e-6  # towards zero: inside the bounds for gap and skew
        moved[index] += step
        touched = np.arange(plays) if problem.common else np.array([index // PARAMETERS])
        pair = EnvelopePairs(*(part[touched] for part in envelopes_of(moved, plays)))
        change = play_regressors(problem.v, problem.radii[touched], *pair)[scored] - outputs[:, touched]
        columns[:, index] = -(change @ weights[touched]) / step
    return columns - basis @ (basis.T @ columns)


@kernel
def play_regressors(
    v: FloatArray, radii: FloatArray, a_R: FloatArray, b_R: FloatArray, a_L: FloatArray, b_L: FloatArray
) -> FloatArray:
    """Outputs (n, plays) of generalised plays that come cooling from saturation; equations (3), (4)."""
    plays = len(radii)
    outputs = np.empty((len(v), plays))
    for j in range(plays):
        w = 1.0 + radii[j]
        for k in range(len(v)):
            if k > 0 and v[k] == v[k - 1]:
                outputs[k, j] = w
                continue
            w = max(w, np.tanh(a_R[j] * v[k] + b_R[j]) - radii[j])
            w = min(w, np.tanh(a_L[j] * v[k] + b_L[j]) + radii[j])
            outputs[k, j] = w
    return outputs
