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
    fit_noise_in_parts,
    group_by_period,
    without_hole,
)
from rtctl.identification.noise.resonant_part import Resonance


def estimate_noise(
    rows: Sequence[RecordRows],
    *,
    resonances: Sequence[Resonance] = (),
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
        resonances: Resonances of the device, at which an unmeasured force is answered.
        slow: Whether the noise may have a slow part (1/f noise).
        only_adds: Whether a slow part can only add to the rest, see `Subject.slow_noise_only_adds`; the first model is
            white then, as the colour of what the directions leave would be that of their hole.
        thresholds: Number of iterations, and what is round-off.
    """
    outputs = rows[0].residual.shape[0]
    groups = group_by_period([row.period_s for row in rows])
    samples = [sum(rows[k].residual.shape[1] for k in group) for group in groups]
    models = _start_with_peak(rows, groups, resonances, thresholds)
    known = bool(models)
    models = models or [NoiseModel(np.empty(0), 1.0)] * outputs
    for turn in range(known, thresholds.noise_iterations + slow + known):
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
                fit_noise_in_parts(
                    [series[k] for k in group],
                    rows[group[0]].period_s,
                    resonances if turn > 0 else (),
                    slow=slow and turn > 0,
                )._replace(period_s=rows[group[0]].period_s)
                for group in groups
            ]
            if only_adds:
                by_period = [without_hole(model) for model in by_period]
            models.append(combine_models(by_period, samples))
    return models


def _start_with_peak(
    rows: Sequence[RecordRows],
    groups: Sequence[Sequence[int]],
    resonances: Sequence[Resonance],
    thresholds: ResidualThresholds,
) -> list[NoiseModel]:
    """Return noise with the peak that an unmeasured force makes; [] where there is no resonance or no peak.

    All directions together take whatever lies in a narrow peak, and nothing would be left to see it by. What is wrong
    with a model is along one or two of them; a noise is along none. So those are taken out of the residual that take
    most of it.
    """
    if not resonances:
        return []
    outputs = rows[0].residual.shape[0]
    white = [NoiseModel(np.empty(0), 1.0)] * outputs
    split = [row.split_off_own(white, thresholds) for row in rows]
    gram = np.sum([part.gram for part in split], axis=0)
    chosen = _main_directions(gram, len(rows[0].shared), sum(row.residual.size for row in rows), thresholds)
    taken, _ = solve_least_squares(gram[np.ix_([0, *chosen], [0, *chosen])])
    weights = np.zeros((1, len(gram)))
    weights[0, [0, *chosen]] = np.append(1.0, -taken)
    models: list[NoiseModel] = []
    for o in range(outputs):
        series = [
            _known_series(row, part, weights, o, whole=False) for row, part in zip(rows, split, strict=True)
        ]
        by_period = [
            fit_noise_in_parts(
                [series[k] for k in group], rows[group[0]].period_s, resonances, slow=False
            )._replace(period_s=rows[group[0]].period_s)
            for group in groups
        ]
        models.append(
            combine_models(by_period, [sum(rows[k].residual.shape[1] for k in group) for group in groups])
        )
    return models if any(one.resonant for model in models for one in (model, *model.others)) else []


def _main_directions(
    gram: FloatArray, shared: int, samples: int, thresholds: ResidualThresholds
) -> list[int]:
    """Return the indices in `gram` of the parameters and of the directions that take most of the residual, in turn."""
    scale = np.sqrt(np.where(np.diag(gram) > 0.0, np.diag(gram), 1.0))
    normal = gram / scale[:, None] / scale
    chosen = list(range(1, 1 + shared))

    def left_by(indices: Sequence[int]) -> float:
        inner = normal[np.ix_(indices, indices)]
        along = normal[0, indices]
        return float(1.0 - along @ np.linalg.pinv(inner, rcond=1e-10, hermitian=True) @ along)

    floor = left_by(range(1, len(gram))) * samples / max(samples - len(gram), 1)
    left = left_by(chosen)
    for _ in range(thresholds.most_noise_directions):
        tried = {k: left_by([*chosen, k]) for k in range(1 + shared, len(gram)) if k not in chosen}
        best = min(tried, key=lambda k: tried[k], default=None)
        if best is None or left - tried[best] < thresholds.noise_direction_share * (left - floor):
            break
        chosen.append(best)
        left = tried[best]
    return chosen


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
