"""Residual and directions of all records beyond what the fitted parameters can follow, from one Gram matrix.

The Gram matrices of [residual, shared sensitivities, directions] of all records are summed; a Schur complement projects
the shared parameters out. Every test of the residual is then one of a small matrix.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection.rows import DEFAULT_THRESHOLDS, RecordRows
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import NoiseModel


class Projected:
    """Residual and directions beyond the fitted parameters, in units of the noise."""

    def __init__(
        self,
        gram: FloatArray,
        whole: FloatArray,
        shared: int,
        samples: int,
        own: int,
        thresholds: ResidualThresholds = DEFAULT_THRESHOLDS,
    ) -> None:
        """Project the shared parameters out.

        Args:
            gram: (1 + p + k, 1 + p + k) of [residual, shared, directions] beyond each record's own parameters.
            whole: (1 + p + k,) squares of the same rows before anything is projected out.
            shared: Number p of shared parameters.
            samples: Number of whitened samples of all records and outputs.
            own: Number of own parameters of all records.
            thresholds: Which directions are visible.
        """
        scale = _root_diagonal(gram)
        normal = gram / scale[:, None] / scale
        self.gram = gram
        """Gram matrix of residual, shared sensitivities and directions beyond each record's own parameters."""
        self.scale = scale
        """(1 + p + k,) root of its diagonal."""
        keep = [0, *range(1 + shared, len(gram))]
        inner = normal[1 : 1 + shared, 1 : 1 + shared]
        solve = np.linalg.pinv(inner, rcond=1e-12, hermitian=True)
        border = normal[np.ix_(keep, range(1, 1 + shared))]
        left = normal[np.ix_(keep, keep)] - border @ solve @ border.T
        self.left = left
        """(1 + k, 1 + k) normalised Gram matrix of residual and directions beyond all parameters."""
        self.followed = border[1:] @ solve
        """(k, p) coefficients of the shared parameters in each direction, both over their scales."""
        self.visible = np.clip(np.diag(left)[1:], 0.0, 1.0)
        """(k,) fraction of each direction's squares that the parameters cannot follow."""
        squares = np.where(whole > 0.0, whole, np.nan)[1 + shared :]
        self.beyond_own = np.clip(np.diag(gram)[1 + shared :] / squares, 0.0, 1.0)
        """(k,) the same of the whole direction and each record's own parameters, such as its start; NaN where a
        direction moves nothing."""
        self.samples = samples
        """Number of whitened samples."""
        self.rank = shared + own
        """Number of parameters, shared and own."""
        self.residual = float(scale[0] ** 2 * left[0, 0])
        """Sum of squares of the whitened residual."""
        self.shift = solve @ normal[1 : 1 + shared, 0] * scale[0] / scale[1 : 1 + shared]
        """(p,) step of the shared parameters that the whitened residual still asks for."""
        self.standard_errors = np.sqrt(np.maximum(np.diag(solve), 0.0)) / scale[1 : 1 + shared]
        """(p,) standard errors of the shared parameters, over their scales."""
        self.covariance = solve / np.outer(scale[1 : 1 + shared], scale[1 : 1 + shared])
        """(p, p) covariance of the shared parameters, over their scales."""
        self.usable: NDArray[np.bool_] = self.visible > thresholds.least_visible_share
        """(k,) which directions are no combination of the parameters' own."""

    def block(self, chosen: NDArray[np.intp]) -> tuple[float, int]:
        """Return the sum of squares that the chosen directions remove together, and their rank."""
        chosen = chosen[self.usable[chosen]]
        removed, rank = score_statistic(self.left[np.ix_(1 + chosen, 1 + chosen)], self.left[1 + chosen, 0])
        return float(self.scale[0] ** 2 * removed), rank

    def single(self) -> FloatArray:
        """Return the sum of squares (k,) that each direction alone removes; 0 where it is not usable."""
        removed = np.zeros(len(self.visible))
        usable = self.usable
        along = self.left[1:, 0]
        removed[usable] = self.scale[0] ** 2 * along[usable] ** 2 / self.visible[usable]
        return removed

    def step(self, shared: int) -> FloatArray:
        """Return the least-squares step (k,) along each direction alone, in the direction's unit."""
        usable = self.usable
        steps = np.zeros(len(self.visible))
        size = self.scale[1 + shared :]
        steps[usable] = -self.left[1:, 0][usable] / self.visible[usable] * self.scale[0] / size[usable]
        return steps


def score_statistic(covariance: FloatArray, score: FloatArray) -> tuple[float, int]:
    """Return score^T covariance^-1 score of a score (m,) with its covariance (m, m), and the rank of the latter."""
    if len(score) == 0:
        return 0.0, 0
    size = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / size[:, None] / size)
    good = values > 1e-9 * values[-1]
    along = vectors[:, good].T @ (score / size)
    return float(np.sum(along**2 / values[good])), int(good.sum())


def project(
    rows: Sequence[RecordRows],
    noise: Sequence[NoiseModel],
    thresholds: ResidualThresholds = DEFAULT_THRESHOLDS,
) -> Projected:
    """Project the parameters out of all records together.

    Args:
        rows: Records, with the same shared parameters and directions.
        noise: Noise model of each output.
        thresholds: What is round-off, and which directions are visible.
    """
    gram, whole, samples, own = _total_gram(rows, noise, thresholds)
    return Projected(gram, whole, rows[0].shared.shape[0], samples, own, thresholds)


def share_by_output(
    projected: Projected, rows: Sequence[RecordRows], noise: Sequence[NoiseModel]
) -> FloatArray:
    """Return how the squares of each direction beyond all parameters are spread over the outputs.

    Args:
        projected: Projection of the same rows by the same noise.
        rows: Records.
        noise: Noise model of each output.

    Returns:
        Shares (outputs, k), whose sum over the outputs is 1.
    """
    count, shared = projected.followed.shape
    squares = np.zeros((len(noise), count))
    for row in rows:
        white, _ = row.whitened(noise)
        white /= projected.scale[:, None]
        left = white[1 + shared :] - projected.followed @ white[1 : 1 + shared]
        squares += np.sum(left.reshape(len(left), len(noise), -1) ** 2, axis=2).T
    shares: FloatArray = squares / np.maximum(squares.sum(axis=0), 1e-300)
    return shares


def unexplained_residual(
    rows: Sequence[RecordRows],
    noise: Sequence[NoiseModel],
    thresholds: ResidualThresholds = DEFAULT_THRESHOLDS,
) -> list[FloatArray]:
    """Return the residual (outputs, n) of each record that neither parameters nor any direction can follow.

    Args:
        rows: Records.
        noise: Noise model of each output.
        thresholds: What is round-off.
    """
    gram, *_ = _total_gram(rows, noise, thresholds)
    count = len(gram)
    scale = _root_diagonal(gram)
    normal = gram / scale[:, None] / scale
    solved = np.linalg.pinv(normal[1:, 1:], rcond=1e-10, hermitian=True) @ normal[1:, 0]
    weights = solved * scale[0] / scale[1:] if count > 1 else np.zeros(0)
    shared, directions = np.split(weights, [len(rows[0].shared)])
    return [row.subtract(shared, directions) for row in rows]


def residual_beyond_parameters(rows: Sequence[RecordRows], projected: Projected) -> list[FloatArray]:
    """Return the residual (outputs, n) of each record that the parameters cannot follow; `projected`: of `rows`."""
    return [row.subtract(projected.shift, np.zeros(len(row.directions))) for row in rows]


def solve_least_squares(gram: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve for all directions together.

    Args:
        gram: Gram matrix (1 + m, 1 + m) of the residual and the directions.

    Returns:
        Weights (m,) of the directions in the residual, and H (rank, m) of which H^T H is their covariance.
    """
    scale = _root_diagonal(gram)
    normal = gram / scale[:, None] / scale
    values, vectors = np.linalg.eigh(normal[1:, 1:])
    good = values > 1e-10 * values[-1] if len(values) else np.zeros(0, bool)
    half = (vectors[:, good] / np.sqrt(values[good])).T / scale[1:]
    return half.T @ (half @ gram[1:, 0]), half


def _total_gram(
    rows: Sequence[RecordRows], noise: Sequence[NoiseModel], thresholds: ResidualThresholds
) -> tuple[FloatArray, FloatArray, int, int]:
    """Return the Gram matrix, the whole rows' squares, the samples and the own parameters of all records."""
    parts = [row.gram(noise, thresholds) for row in rows]
    gram = np.sum([part for part, _, _, _ in parts], axis=0)
    whole = np.sum([squares for _, squares, _, _ in parts], axis=0)
    return gram, whole, sum(samples for _, _, samples, _ in parts), sum(own for _, _, _, own in parts)


def _root_diagonal(gram: FloatArray) -> FloatArray:
    """Return the roots of the diagonal; 1 where it is zero."""
    squares = np.diag(gram)
    return np.sqrt(np.where(squares > 0.0, squares, 1.0))
