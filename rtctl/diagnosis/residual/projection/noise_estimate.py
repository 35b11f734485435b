"""The noise of each output, by restricted maximum likelihood: from what no direction explains of the residual.

Reference: H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545, here by expectation and maximisation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection.projected import solve_least_squares
from rtctl.diagnosis.residual.projection.rows import DEFAULT_THRESHOLDS, RecordProjection, RecordRows
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import (
    NoiseModel,
    combine_models,
    fit_noise_with_slow_part,
    group_by_period,
    without_hole,
)


def estimate_noise(
    rows: Sequence[RecordRows],
    *,
    slow: bool = False,
    only_adds: bool = False,
    thresholds: ResidualThresholds = DEFAULT_THRESHOLDS,
) -> list[NoiseModel]:
    """Estimate the noise model of each output.

    Directions take the noise that lies along them, all of them near a resonance. The spectrum of the unexplained
    residual alone has a hole there, and every statistic would be too large. Under a noise model the unexplained
    residual and the covariance of what was taken are known (generalised least squares), and both together give the
    next model.

    Args:
        rows: All records; those of another sample period get a noise model of their own.
        slow: Whether the noise may have a slow part (1/f noise).
        only_adds: Whether a slow part can only add to the rest, see `Subject.slow_noise_only_adds`; the first model is
            white then, as the colour of what the directions leave would be that of their hole.
        thresholds: Number of iterations, and what is round-off.
    """
    outputs = rows[0].residual.shape[0]
    models = [NoiseModel(np.empty(0), 1.0)] * outputs
    groups = group_by_period([row.period_s for row in rows])
    samples = [sum(rows[k].residual.shape[1] for k in group) for group in groups]
    for turn in range(thresholds.noise_iterations + slow):
        split = [row.split_off_own(models, thresholds) for row in rows]
        taken, half = solve_least_squares(np.sum([part.gram for part in split], axis=0))
        weights = np.append(1.0, -taken)[None]
        if turn > 0:  # the first model's unit is not that of the noise
            weights = np.vstack((weights, np.pad(half, ((0, 0), (1, 0)))))
        models = []
        for o in range(outputs):
            series = [
                _known_series(row, part, weights, o, whole=turn > 0)
                for row, part in zip(rows, split, strict=True)
            ]
            if only_adds and turn == 0:
                models.append(_white(series, len(half)))
                continue
            by_period = [
                fit_noise_with_slow_part([series[k] for k in group], slow=slow and turn > 0)._replace(
                    period_s=rows[group[0]].period_s
                )
                for group in groups
            ]
            if only_adds:
                by_period = [without_hole(model) for model in by_period]
            models.append(combine_models(by_period, samples))
    return models


def _white(series: Sequence[FloatArray], taken: int) -> NoiseModel:
    """Return white noise of what is left in the first row of series (m, n), of which so many directions took a part."""
    left = np.concatenate([one[0] for one in series])
    return NoiseModel(np.empty(0), float(left @ left) / max(len(left) - taken, 1))


def _known_series(
    row: RecordRows, part: RecordProjection, weights: FloatArray, output: int, *, whole: bool
) -> FloatArray:
    """Return the combinations (m, n) of one output that the noise is estimated from.

    Args:
        row: Record.
        part: Its projection by the present noise model.
        weights: (m, 1 + p + k) combinations of [residual, shared, directions].
        output: Index of the output.
        whole: Whether the uncertainty of the own parameters is included.
    """
    own = -weights @ part.followed
    if whole:
        weights = np.vstack((weights, np.zeros((len(part.half), weights.shape[1]))))
        own = np.vstack((own, part.half))
    return row.combine(weights, own, output)
