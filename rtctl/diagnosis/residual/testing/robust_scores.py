"""Scores of directions with a covariance that holds for heteroscedastic noise: a louder record, coarse rounding.

With x the whitened directions beyond all parameters, r the residual, e what nothing follows and h the leverages,

    score g = x r,   its covariance V = sum_i x_i x_i^T (e_i / (1 - h_i))^2,   g^T V^-1 g ~ chi-squared

so noise that is white but of another size from sample to sample raises no false alarm.

Reference: J. G. MacKinnon, H. White, Some heteroskedasticity-consistent covariance matrix estimators with improved
finite sample properties, J. Econometrics 29 (1985) 305 (HC3).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection import Projected, RecordRows, score_statistic, solve_least_squares
from rtctl.identification.noise.residual_noise import NoiseModel


class RobustScores(NamedTuple):
    """Scores of directions with their robust covariance, with the interface of `Projected`."""

    score: FloatArray
    """(k,) score of each direction."""
    covariance: FloatArray
    """(k, k) covariance of the scores."""
    usable: NDArray[np.bool_]
    """(k,) which directions are no combination of the parameters' own."""

    def single(self) -> FloatArray:
        """Return the squared score (k,) of each direction alone over its variance; 0 where it is not usable."""
        variance = np.diag(self.covariance)
        seen = self.usable & (variance > 0.0)
        squares: FloatArray = np.where(seen, self.score**2 / np.where(seen, variance, 1.0), 0.0)
        return squares

    def block(self, chosen: NDArray[np.intp]) -> tuple[float, int]:
        """Return the statistic of the chosen directions together, and its rank."""
        chosen = chosen[self.usable[chosen] & (np.diag(self.covariance)[chosen] > 0.0)]
        return score_statistic(self.covariance[np.ix_(chosen, chosen)], self.score[chosen])


def robust_scores(
    rows: Sequence[RecordRows], noise: Sequence[NoiseModel], projected: Projected, most_leverage: float
) -> RobustScores:
    """Return the scores of all directions with their robust covariance.

    Args:
        rows: Records.
        noise: Noise model of each output.
        projected: Projection of the same rows by the same noise.
        most_leverage: Leverage of a sample that is corrected for at most.
    """
    shared, scale = len(rows[0].shared), projected.scale
    taken, half = solve_least_squares(projected.gram)
    count = len(projected.visible)
    covariance = np.zeros((count, count))
    for row in rows:
        white, basis = row.whitened(noise)
        left = white[0] - taken @ white[1:]
        leverage = np.sum((half @ white[1:]) ** 2, axis=0) + np.sum(basis**2, axis=1)
        left /= 1.0 - np.minimum(leverage, most_leverage)
        white /= scale[:, None]
        beyond = white[1 + shared :] - projected.followed @ white[1 : 1 + shared]
        beyond *= left
        covariance += beyond @ beyond.T
    return RobustScores(scale[0] * projected.left[1:, 0], covariance, projected.usable)
