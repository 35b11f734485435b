"""Which of several noise models suits a residual beside many directions: by restricted likelihood, less its parameters.

With V the covariance of the noise and X all that may be followed (parameters, starts, directions),

    -2 l = log|V| + log|X' V^-1 X| + r' P r,   r' P r the squares that X leaves of the residual,

and a model of k parameters pays k log(n - rank) more (BIC). Directions that fill a band of frequencies leave a hole in
the residual; an autoregression of many coefficients that follows the hole gains little likelihood by each.

Reference: H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545; G. Schwarz, Ann. Statist. 6 (1978) 461.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection.rows import RecordRows
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import NoiseModel

ROUND_OFF = 1e-8
"""Eigenvalue of the normalised directions over the largest, below which a direction is one of the others."""


def most_likely(
    rows: Sequence[RecordRows], candidates: Sequence[Sequence[NoiseModel]], thresholds: ResidualThresholds
) -> list[NoiseModel]:
    """Return the candidate, noise models of all outputs, with the highest restricted likelihood less its parameters."""
    basis = _independent(rows, thresholds)
    scores = [score(rows, models, basis, thresholds) for models in candidates]
    return list(candidates[int(np.argmax(scores))])


def score(
    rows: Sequence[RecordRows],
    models: Sequence[NoiseModel],
    basis: FloatArray,
    thresholds: ResidualThresholds,
) -> float:
    """Return the restricted log-likelihood of noise models, less half of log(n - rank) for each of their parameters.

    Args:
        rows: Records.
        models: Noise model of each output.
        basis: (p + k, rank) independent combinations of the shared parameters and the directions.
        thresholds: What is round-off.
    """
    twice, gram = 0.0, np.zeros((1 + len(basis), 1 + len(basis)))
    samples = taken = 0
    for row in rows:
        split = row.split_off_own(models, thresholds)
        gram += split.gram
        twice += sum(_log_determinant(model.for_period(row.period_s), row) for model in models)
        twice -= 2.0 * float(np.linalg.slogdet(split.half)[1]) if len(split.half) else 0.0
        samples, taken = samples + row.residual.size, taken + len(split.half)
    inner, along = basis.T @ gram[1:, 1:] @ basis, basis.T @ gram[1:, 0]
    twice += float(np.linalg.slogdet(inner)[1])
    twice += float(gram[0, 0]) - float(along @ np.linalg.lstsq(inner, along, rcond=None)[0])
    left = max(samples - taken - basis.shape[1], 2)
    unknowns = sum(model.parameters for model in models)
    return float(-0.5 * (twice + unknowns * math.log(left)))


def _independent(rows: Sequence[RecordRows], thresholds: ResidualThresholds) -> FloatArray:
    """Return the combinations (p + k, rank) of shared parameters and directions that are none of the others'."""
    white = [NoiseModel(np.empty(0), 1.0)] * rows[0].residual.shape[0]
    gram = np.sum([row.split_off_own(white, thresholds).gram for row in rows], axis=0)[1:, 1:]
    scale = np.sqrt(np.where(np.diag(gram) > 0.0, np.diag(gram), 1.0))
    values, vectors = np.linalg.eigh(gram / scale[:, None] / scale)
    basis: FloatArray = vectors[:, values > ROUND_OFF * values[-1]] / scale[:, None]
    return basis


def _log_determinant(model: NoiseModel, row: RecordRows) -> float:
    """Return log|V| of a noise model over the samples of a record: its whitener is triangular, of one diagonal."""
    samples = row.residual.shape[1]
    impulse = np.zeros(samples)
    impulse[samples // 2] = 1.0
    return float(-2.0 * samples * np.log(abs(model.whiten(impulse)[samples // 2])))
