"""Scores of directions where the noise is not as large everywhere: one record is noisier, a converter rounds in places.

With x the whitened directions beyond all unknowns, r the residual and e what nothing follows,

    score g = x r,   its covariance V = sum_i x_i x_i^T (e_i / (1 - h_i))^2,   g^T V^-1 g ~ chi^2

h the leverages: noise that is white but of another size from sample to sample leaves no false alarm.

Reference: J. G. MacKinnon, H. White, Some heteroskedasticity-consistent covariance matrix estimators with improved
finite sample properties, J. Econometrics 29 (1985) 305 (their third).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection import Projected, Rows, least_squares, strength
from rtctl.identification.noise.residual_noise import NoiseModel

MOST_LEVERAGE = 0.9
"""Of a sample: one that a direction follows alone says nothing of the noise there."""


class Uneven(NamedTuple):
    """Directions with the covariance of their scores; see `Projected`."""

    score: FloatArray
    """(k,)"""
    covariance: FloatArray
    """(k, k)"""
    usable: NDArray[np.bool_]

    def single(self) -> FloatArray:
        """(k,) squared score of each direction alone over its variance; 0 where it is not usable."""
        variance = np.diag(self.covariance)
        seen = self.usable & (variance > 0.0)
        found: FloatArray = np.where(seen, self.score**2 / np.where(seen, variance, 1.0), 0.0)
        return found

    def block(self, chosen: NDArray[np.intp]) -> tuple[float, int]:
        """Of the chosen directions together, and their rank."""
        chosen = chosen[self.usable[chosen] & (np.diag(self.covariance)[chosen] > 0.0)]
        return strength(self.covariance[np.ix_(chosen, chosen)], self.score[chosen])


def uneven(rows: Sequence[Rows], noise: Sequence[NoiseModel], projected: Projected) -> Uneven:
    """`projected`: of the same rows and noise."""
    shared, scale = len(rows[0].shared), projected.scale
    taken, half = least_squares(projected.gram)
    count = len(projected.visible)
    covariance = np.zeros((count, count))
    for row in rows:
        white, basis = row.whitened(noise)
        left = white[0] - taken @ white[1:]
        leverage = np.sum((half @ white[1:]) ** 2, axis=0) + np.sum(basis**2, axis=1)
        left /= 1.0 - np.minimum(leverage, MOST_LEVERAGE)
        white /= scale[:, None]
        beyond = white[1 + shared :] - projected.followed @ white[1 : 1 + shared]
        beyond *= left
        covariance += beyond @ beyond.T
    return Uneven(scale[0] * projected.left[1:, 0], covariance, projected.usable)
