"""The noise of each output, by restricted maximum likelihood: from what no direction explains of the residual.

Reference: H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545, here by expectation and maximisation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.residual.projection.projected import solve_least_squares
from rtctl.diagnosis.residual.projection.restricted_likelihood import most_likely
from rtctl.diagnosis.residual.projection.rows import DEFAULT_THRESHOLDS, RecordProjection, RecordRows
from rtctl.diagnosis.thresholds import ResidualThresholds
from rtctl.identification.noise.residual_noise import (
    NoiseModel,
    combine_models,
    fit_noise_in_parts,
    group_by_period,
)
from rtctl.identification.noise.resonant_part import Resonance
from rtctl.identification.threads import each


def estimate_noise(
    rows: Sequence[RecordRows],
    *,
    resonances: Sequence[Resonance] = (),
    slow: bool = False,
    starts_white: bool = False,
    thresholds: ResidualThresholds = DEFAULT_THRESHOLDS,
    executor: Executor | None = None,
) -> list[NoiseModel]:
    """Estimate the noise model of each output.

    Directions take the noise that lies along them, all of them near a resonance. The spectrum of the unexplained
    residual alone has a hole there, and every statistic would be too large. Under a noise model the unexplained
    residual and the covariance of what was taken are known (generalised least squares), and both together give the
    next model. Of few samples the directions take nearly all in a band, and what began as a hole stays one: then the
    noise is estimated from a white start as well, and the likelier model counts.

    Args:
        rows: All records; those of another sample period get a noise model of their own.
        resonances: Resonances of the device, at which an unmeasured force is answered.
        slow: Whether the noise may have a slow part (1/f noise).
        starts_white: Whether the noise is first taken as white, see `Subject.noise_starts_white`.
        thresholds: Number of iterations, and what is round-off.
        executor: Takes the records in parallel; None: one after the other.
    """
    estimate = _Estimate(
        rows=rows, resonances=resonances, slow=slow, thresholds=thresholds, executor=executor
    )
    split = estimate.split(_white_residual(rows))
    found = estimate.iterate(split, estimate.start_with_peak(split), starts_white=starts_white)
    directions = len(split[0].gram) - 1
    if starts_white or directions <= thresholds.crowded_share * sum(row.residual.size for row in rows):
        return found
    further = replace(thresholds, noise_iterations=thresholds.crowded_iterations)
    other = replace(estimate, thresholds=further).iterate(split, [], starts_white=True)
    return most_likely(rows, (found, other), thresholds)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Estimate:
    """What an estimate of the noise does not change."""

    rows: Sequence[RecordRows]
    resonances: Sequence[Resonance]
    slow: bool
    thresholds: ResidualThresholds
    executor: Executor | None

    def iterate(
        self, split: Sequence[RecordProjection], models: Sequence[NoiseModel], *, starts_white: bool
    ) -> list[NoiseModel]:
        """Return the noise after some iterations from `models`; [] starts from what white noise leaves unexplained."""
        is_sized = bool(models)  # a residual is not the noise: it may be far larger
        if is_sized:
            split = self.split(models)
        turns = self.thresholds.noise_iterations + self.slow
        for turn in range(turns):
            taken, half = solve_least_squares(np.sum([part.gram for part in split], axis=0))
            weights = np.append(1.0, -taken)[None]
            if is_sized:
                weights = np.vstack((weights, np.pad(half, ((0, 0), (1, 0)))))
            series = self._series_by_output(split, weights, whole=is_sized)
            if is_sized or not starts_white:
                peaks = self.resonances if is_sized else ()
                models = [self._fit_by_period(one, peaks, slow=self.slow and is_sized) for one in series]
            else:
                models = [_white(one, len(half)) for one in series]
            is_sized = True
            if turn < turns - 1:
                split = self.split(models)
        return list(models)

    def split(self, models: Sequence[NoiseModel]) -> list[RecordProjection]:
        """Return the rows of each record in the metric of `models`, split by what its own parameters follow."""
        return each(self.executor, lambda row: row.split_off_own(models, self.thresholds), self.rows)

    def start_with_peak(self, split: Sequence[RecordProjection]) -> list[NoiseModel]:
        """Return noise with the peak that an unmeasured force makes; [] where there is no resonance or no peak.

        All directions together take whatever lies in a narrow peak, and nothing would be left to see it by. What is
        wrong with a model is along one or two of them; a noise is along none. So those are taken out of the residual
        that take most of it. `split` is that of white noise.
        """
        if not self.resonances:
            return []
        gram = np.sum([part.gram for part in split], axis=0)
        samples = sum(row.residual.size for row in self.rows)
        chosen = _main_directions(gram, len(self.rows[0].shared), samples, self.thresholds)
        taken, _ = solve_least_squares(gram[np.ix_([0, *chosen], [0, *chosen])])
        weights = np.zeros((1, len(gram)))
        weights[0, [0, *chosen]] = np.append(1.0, -taken)
        series = self._series_by_output(split, weights, whole=False)
        models = [self._fit_by_period(one, self.resonances, slow=False) for one in series]
        return models if any(one.resonant for model in models for one in (model, *model.others)) else []

    def _series_by_output(
        self, split: Sequence[RecordProjection], weights: FloatArray, *, whole: bool
    ) -> Iterator[list[FloatArray]]:
        """Yield for each output what its noise is estimated from, by record, see `_known_series`."""
        for output in range(self.rows[0].residual.shape[0]):

            def known(of: tuple[RecordRows, RecordProjection], output: int = output) -> FloatArray:
                return _known_series(*of, weights, output, whole=whole)

            yield each(self.executor, known, zip(self.rows, split, strict=True))

    def _fit_by_period(
        self, series: Sequence[FloatArray], resonances: Sequence[Resonance], *, slow: bool
    ) -> NoiseModel:
        """Fit the noise of one output, one model for each sample period of the records."""
        groups = group_by_period([row.period_s for row in self.rows])
        models = []
        for group in groups:
            period_s = self.rows[group[0]].period_s
            own = [series[k] for k in group]
            found = fit_noise_in_parts(own, period_s, resonances, slow=slow, executor=self.executor)
            models.append(found._replace(period_s=period_s))
        return combine_models(
            models, [sum(self.rows[k].residual.shape[1] for k in group) for group in groups]
        )


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


def _white_residual(rows: Sequence[RecordRows]) -> list[NoiseModel]:
    """Return white noise as large as each output's residual: outputs in unlike units count alike.

    Of one output the size does not matter.
    """
    if rows[0].residual.shape[0] == 1:
        return [NoiseModel(np.empty(0), 1.0)]
    squares = [
        np.mean(np.concatenate([row.residual[output] for row in rows]) ** 2)
        for output in range(rows[0].residual.shape[0])
    ]
    return [NoiseModel(np.empty(0), float(square) if square > 0.0 else 1.0) for square in squares]


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
