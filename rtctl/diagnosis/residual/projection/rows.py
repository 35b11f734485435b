"""One record as rows of a linear regression: its residual, its sensitivities, and directions to test.

The rows are whitened by the noise, and the record's own parameters (its initial state) are projected out here, record
by record. What all records share is projected out of the sum of their Gram matrices, so that the memory needed is that
of one record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.work import count_work
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import NoiseModel

DEFAULT_THRESHOLDS = ResidualThresholds()
STEPS_OF_A_WHITENED_READING = 3.0
"""Integration steps that take as long as whitening one reading of one row does (measured: 0.1 us to 0.03 us)."""


class RecordProjection(NamedTuple):
    """One record's rows in the metric of the noise, split by what its own parameters follow."""

    gram: FloatArray
    """(1 + p + k, 1 + p + k) Gram matrix of [residual, shared, directions] without what the own parameters follow."""
    followed: FloatArray
    """(1 + p + k, q) coefficients of each own sensitivity in each row."""
    half: FloatArray
    """(q, q) root of the covariance of the own parameters: half^T half."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordRows:
    """One record: its residual, and the derivatives of the outputs along parameters and directions."""

    residual: FloatArray
    """(outputs, n) simulation minus measurement, in the outputs' units."""
    shared: FloatArray
    """(p, outputs, n) sensitivities by the scaled parameters that all records share."""
    local: FloatArray
    """(q, outputs, n) sensitivities by this record's own parameters, such as its initial state."""
    directions: FloatArray
    """(k, outputs, n) directions in which the model may be wrong."""
    period_s: float = 0.0
    """Sample period [s], at which the noise has a colour of its own; 0 where all records are sampled alike."""

    def without(self, samples: NDArray[np.bool_]) -> RecordRows:
        """Return the same rows with zeros where `samples` (n,) are true: these tell nothing."""
        kept = ~samples
        return replace(
            self,
            residual=self.residual * kept,
            shared=self.shared * kept,
            local=self.local * kept,
            directions=self.directions * kept,
        )

    def whitened(self, noise: Sequence[NoiseModel]) -> tuple[FloatArray, FloatArray]:
        """Return the whitened rows without what the own parameters follow, and a basis of the latter.

        Returns:
            [residual, shared, directions] (1 + p + k, outputs n), and an orthonormal basis (outputs n, q) of the own
            sensitivities.
        """
        flat, basis = self._split(noise)
        return flat - (flat @ basis) @ basis.T, basis

    def gram(
        self, noise: Sequence[NoiseModel], thresholds: ResidualThresholds = DEFAULT_THRESHOLDS
    ) -> tuple[FloatArray, FloatArray, int, int]:
        """Return the Gram matrix of `whitened` without building these rows.

        Returns:
            The matrix (1 + p + k, 1 + p + k), the squares (1 + p + k,) of the whole rows, the number of samples, and
            the number of own parameters projected out.
        """
        flat, basis = self._split(noise)
        gram = _gram_beyond(flat, flat @ basis, thresholds.round_off_share)
        return gram, np.einsum("ij,ij->i", flat, flat), flat.shape[1], basis.shape[1]

    def split_off_own(
        self, noise: Sequence[NoiseModel], thresholds: ResidualThresholds = DEFAULT_THRESHOLDS
    ) -> RecordProjection:
        """Return what the own parameters can follow of [residual, shared, directions], in the metric of the noise."""
        white = self._all_white(noise)
        flat, own = np.split(white, [len(white) - len(self.local)])
        if len(own) == 0:
            return RecordProjection(flat @ flat.T, np.zeros((len(flat), 0)), np.zeros((0, 0)))
        basis, triangle = np.linalg.qr(own.T)
        along = flat @ basis
        inverse = np.linalg.pinv(triangle)
        gram = _gram_beyond(flat, along, thresholds.round_off_share)
        return RecordProjection(gram, along @ inverse.T, inverse.T)

    def combine(self, weights: FloatArray, own: FloatArray, output: int) -> FloatArray:
        """Return linear combinations (m, n) of the rows of one output.

        Args:
            weights: (m, 1 + p + k) of [residual, shared, directions].
            own: (m, q) of the own sensitivities.
            output: Index of the output.
        """
        shared, directions = np.split(weights[:, 1:], [len(self.shared)], axis=1)
        combined = shared @ self.shared[:, output]
        combined += weights[:, :1] * self.residual[output]
        for factors, slopes in ((directions, self.directions), (own, self.local)):
            if len(slopes):
                combined += factors @ slopes[:, output]
        return combined

    def subtract(self, shared: FloatArray, directions: FloatArray) -> FloatArray:
        """Return the residual (outputs, n) less what parameters and directions explain of it.

        Args:
            shared: (p,) coefficients of the shared sensitivities.
            directions: (k,) coefficients of the directions.

        Returns:
            The rest, also without what the own parameters can follow (by plain least squares).
        """
        rest = self.residual - np.tensordot(shared, self.shared, axes=1)
        rest = rest - np.tensordot(directions, self.directions, axes=1)
        if len(self.local):
            basis = np.linalg.qr(self.local.reshape(len(self.local), -1).T)[0]
            flat = rest.reshape(-1)
            rest = (flat - basis @ (basis.T @ flat)).reshape(rest.shape)
        return rest

    def _split(self, noise: Sequence[NoiseModel]) -> tuple[FloatArray, FloatArray]:
        """Return [residual, shared, directions] whitened, and an orthonormal basis (outputs n, q) of the own rows."""
        flat = self._all_white(noise)
        kept = len(flat) - len(self.local)
        if len(self.local) == 0:
            return flat, np.zeros((flat.shape[1], 0))
        return flat[:kept], np.linalg.qr(flat[kept:].T)[0]

    def _all_white(self, noise: Sequence[NoiseModel]) -> FloatArray:
        """Return [residual, shared, directions, own] whitened (1 + p + k + q, outputs n)."""
        parts = (self.residual[None], self.shared, self.directions, self.local)
        count = sum(len(part) for part in parts)
        white = np.empty((count, *self.residual.shape))
        begin = 0
        for part in parts:
            for o, model in enumerate(noise if len(part) else ()):
                white[begin : begin + len(part), o] = model.for_period(self.period_s).whiten(part[:, o])
            begin += len(part)
        count_work(STEPS_OF_A_WHITENED_READING * white.size)
        return white.reshape(count, -1)


def _gram_beyond(flat: FloatArray, along: FloatArray, round_off_share: float) -> FloatArray:
    """Return the Gram matrix (m, m) of rows less their components along an orthonormal basis.

    A row that the basis follows to round-off (the offset of a sensor beside a mass that no spring holds) becomes zero,
    else its round-off would be a direction.

    Args:
        flat: Rows (m, n).
        along: Their components (m, q) along the basis.
        round_off_share: Fraction of a row's squares that is round-off.
    """
    whole = flat @ flat.T
    left: FloatArray = whole - along @ along.T
    followed = np.diag(left) <= round_off_share * np.diag(whole)
    left[followed] = 0.0
    left[:, followed] = 0.0
    return left
