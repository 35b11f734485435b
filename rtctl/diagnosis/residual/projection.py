"""What is left of residual and directions beyond what a hypothesis' own unknowns can follow: all from one Gram matrix.

Rows [residual, slopes of the shared unknowns, directions]; whitened; each record's own unknowns (initial state) are
taken off record by record, the shared ones by a Schur complement. So memory is one record, and every test below is a
small matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.noise.residual_noise import (
    NoiseModel,
    combine_models,
    fit_noise_with_slow_part,
    group_by_period,
)

LEAST_VISIBLE = 1e-9
"""Squared share of a direction that must remain: below it, it is a combination of others."""
ROUND_OFF = 1e-10
"""Squared share of a row beyond a record's own unknowns that is none."""
RESTRICTED_TURNS = 3
"""Of the noise's estimate; the second knows its size, the third its colour; one more its slow part."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rows:
    """One record: residual (outputs, n), slopes (p, outputs, n), own (q, outputs, n), directions (k, outputs, n)."""

    residual: FloatArray
    shared: FloatArray
    local: FloatArray
    directions: FloatArray
    period_s: float = 0.0
    """Between samples: noise has a colour of its own at each; 0 where all records are sampled alike."""

    def whitened(self, noise: Sequence[NoiseModel]) -> tuple[FloatArray, FloatArray]:
        """[residual, shared, directions] (1 + p + k, outputs n) without their part along the own unknowns."""
        flat, basis = self._white(noise)
        return flat - (flat @ basis) @ basis.T, basis

    def gram(self, noise: Sequence[NoiseModel]) -> tuple[FloatArray, int, int]:
        """Of `whitened`, (1 + p + k, 1 + p + k), without making it; samples; how many own unknowns were taken off."""
        flat, basis = self._white(noise)
        return _left(flat, flat @ basis), flat.shape[1], basis.shape[1]

    def _white(self, noise: Sequence[NoiseModel]) -> tuple[FloatArray, FloatArray]:
        """[residual, shared, directions] whitened, and an orthonormal basis (outputs n, q) of the own unknowns."""
        flat = self._all_white(noise)
        kept = len(flat) - len(self.local)
        if len(self.local) == 0:
            return flat, np.zeros((flat.shape[1], 0))
        return flat[:kept], np.linalg.qr(flat[kept:].T)[0]

    def _all_white(self, noise: Sequence[NoiseModel]) -> FloatArray:
        """[residual, shared, directions, own] whitened (1 + p + k + q, outputs n)."""
        parts = (self.residual[None], self.shared, self.directions, self.local)
        count = sum(len(part) for part in parts)
        white = np.empty((count, *self.residual.shape))
        begin = 0
        for part in parts:
            for o, model in enumerate(noise if len(part) else ()):
                white[begin : begin + len(part), o] = model.for_period(self.period_s).whiten(part[:, o])
            begin += len(part)
        return white.reshape(count, -1)

    def combined(self, weights: FloatArray, own: FloatArray, output: int) -> FloatArray:
        """(m, n) weights (m, 1 + p + k) of [residual, shared, directions] and `own` (m, q) of the own, of an output."""
        shared, directions = np.split(weights[:, 1:], [len(self.shared)], axis=1)
        made = shared @ self.shared[:, output]
        made += weights[:, :1] * self.residual[output]
        for factors, slopes in ((directions, self.directions), (own, self.local)):
            if len(slopes):
                made += factors @ slopes[:, output]
        return made

    def apart(self, noise: Sequence[NoiseModel]) -> Apart:
        """What the own unknowns can follow of [residual, shared, directions], in the noise's metric."""
        white = self._all_white(noise)
        flat, own = np.split(white, [len(white) - len(self.local)])
        if len(own) == 0:
            return Apart(flat @ flat.T, np.zeros((len(flat), 0)), np.zeros((0, 0)))
        basis, triangle = np.linalg.qr(own.T)
        along = flat @ basis
        inverse = np.linalg.pinv(triangle)
        return Apart(_left(flat, along), along @ inverse.T, inverse.T)


def _left(flat: FloatArray, along: FloatArray) -> FloatArray:
    """Gram matrix (m, m) of the rows of `flat` (m, n) without their parts `along` (m, q) an orthonormal basis.

    What the own unknowns follow to round-off (a sensor's offset, of a mass that nothing holds) is zero, else round-off
    would be a direction.
    """
    whole = flat @ flat.T
    left: FloatArray = whole - along @ along.T
    followed = np.diag(left) <= ROUND_OFF * np.diag(whole)
    left[followed] = 0.0
    left[:, followed] = 0.0
    return left


def _sizes(gram: FloatArray) -> FloatArray:
    """Roots of the diagonal; 1 where nothing is left."""
    squares = np.diag(gram)
    return np.sqrt(np.where(squares > 0.0, squares, 1.0))


class Apart(NamedTuple):
    """One record and its own unknowns."""

    gram: FloatArray
    """(1 + p + k, 1 + p + k) of [residual, shared, directions] whitened, without what the own unknowns follow."""
    followed: FloatArray
    """(1 + p + k, q): so much of each own slope."""
    half: FloatArray
    """(q, q): half^T half is the covariance of the own unknowns."""


class Projected:
    """Residual and directions beyond `shared`, in units of the noise."""

    def __init__(self, gram: FloatArray, shared: int, samples: int, own: int) -> None:
        scale = _sizes(gram)
        normal = gram / scale[:, None] / scale
        self.gram = gram
        """Of residual, shared slopes and directions beyond each record's own unknowns."""
        self.scale = scale
        keep = [0, *range(1 + shared, len(gram))]
        inner = normal[1 : 1 + shared, 1 : 1 + shared]
        self._solve = np.linalg.pinv(inner, rcond=1e-12, hermitian=True)
        border = normal[np.ix_(keep, range(1, 1 + shared))]
        left = normal[np.ix_(keep, keep)] - border @ self._solve @ border.T
        self.left = left
        self.followed = border[1:] @ self._solve
        """(k, p) of each direction along the shared unknowns, both over their scales."""
        self.visible = np.clip(np.diag(left)[1:], 0.0, 1.0)
        """(k,) squared share of each direction that the hypothesis cannot follow."""
        self.samples = samples
        self.rank = shared + own
        self.residual = float(scale[0] ** 2 * left[0, 0])
        """Sum of squares."""
        self.shift = self._solve @ normal[1 : 1 + shared, 0] * scale[0] / scale[1 : 1 + shared]
        """(p,) along the shared unknowns, what the whitened residual still asks of them."""
        self.standard_errors = np.sqrt(np.maximum(np.diag(self._solve), 0.0)) / scale[1 : 1 + shared]
        """(p,) of the shared unknowns, for noise of variance 1 after whitening."""
        self.covariance = self._solve / np.outer(scale[1 : 1 + shared], scale[1 : 1 + shared])
        """(p, p) of the shared unknowns."""

    @property
    def usable(self) -> NDArray[np.bool_]:
        """(k,) which directions are no combination of the hypothesis' own."""
        return self.visible > LEAST_VISIBLE

    def block(self, chosen: NDArray[np.intp]) -> tuple[float, int]:
        """Sum of squares that the chosen directions remove together, and their rank."""
        chosen = chosen[self.usable[chosen]]
        removed, rank = strength(self.left[np.ix_(1 + chosen, 1 + chosen)], self.left[1 + chosen, 0])
        return float(self.scale[0] ** 2 * removed), rank

    def single(self) -> FloatArray:
        """(k,) sum of squares that each direction alone removes; 0 where it is not usable."""
        removed = np.zeros(len(self.visible))
        usable = self.usable
        along = self.left[1:, 0]
        removed[usable] = self.scale[0] ** 2 * along[usable] ** 2 / self.visible[usable]
        return removed

    def step(self, shared: int) -> FloatArray:
        """(k,) least-squares step along each direction alone, its own unit."""
        usable = self.usable
        steps = np.zeros(len(self.visible))
        size = self.scale[1 + shared :]
        steps[usable] = -self.left[1:, 0][usable] / self.visible[usable] * self.scale[0] / size[usable]
        return steps


def strength(covariance: FloatArray, score: FloatArray) -> tuple[float, int]:
    """score^T covariance^-1 score (m,), (m, m), and the rank that it is taken in."""
    if len(score) == 0:
        return 0.0, 0
    size = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / size[:, None] / size)
    good = values > 1e-9 * values[-1]
    along = vectors[:, good].T @ (score / size)
    return float(np.sum(along**2 / values[good])), int(good.sum())


def project(rows: Sequence[Rows], noise: Sequence[NoiseModel]) -> Projected:
    """All records together."""
    gram, samples, own = _total(rows, noise)
    return Projected(gram, rows[0].shared.shape[0], samples, own)


def by_output(projected: Projected, rows: Sequence[Rows], noise: Sequence[NoiseModel]) -> FloatArray:
    """(outputs, k): of each direction beyond all unknowns, how its square is spread over the outputs; 1 in all.

    `projected`: of the same rows and noise.
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


def _total(rows: Sequence[Rows], noise: Sequence[NoiseModel]) -> tuple[FloatArray, int, int]:
    """Gram matrix, samples and own unknowns of all records."""
    made = [row.gram(noise) for row in rows]
    gram = np.sum([one for one, _, _ in made], axis=0)
    return gram, sum(samples for _, samples, _ in made), sum(own for _, _, own in made)


def leftover(rows: Sequence[Rows], noise: Sequence[NoiseModel]) -> list[FloatArray]:
    """(outputs, n) of each record: residual that neither own unknowns, shared ones nor any direction can follow."""
    gram, _, _ = _total(rows, noise)
    count = len(gram)
    scale = _sizes(gram)
    normal = gram / scale[:, None] / scale
    solved = np.linalg.pinv(normal[1:, 1:], rcond=1e-10, hermitian=True) @ normal[1:, 0]
    weights = solved * scale[0] / scale[1:] if count > 1 else np.zeros(0)
    shared, free = np.split(weights, [len(rows[0].shared)])
    return [_less(row, shared, free) for row in rows]


def beyond_unknowns(rows: Sequence[Rows], projected: Projected) -> list[FloatArray]:
    """(outputs, n) of each record: residual that neither own unknowns nor shared ones can follow.

    `projected`: of the same rows.
    """
    return [_less(row, projected.shift, np.zeros(len(row.directions))) for row in rows]


def _less(row: Rows, shared: FloatArray, free: FloatArray) -> FloatArray:
    """Its residual without so much of the shared slopes (p,) and directions (k,), and what its own unknowns follow."""
    without = row.residual - np.tensordot(shared, row.shared, axes=1)
    without = without - np.tensordot(free, row.directions, axes=1)
    if len(row.local):
        basis = np.linalg.qr(row.local.reshape(len(row.local), -1).T)[0]
        flat = without.reshape(-1)
        without = (flat - basis @ (basis.T @ flat)).reshape(without.shape)
    return without


def noise_of(rows: Sequence[Rows], *, slow: bool = False) -> list[NoiseModel]:
    """Of each output, by restricted maximum likelihood: from what no direction explains, and what they took of it.

    With a slow part where asked (`slow`) and seen; records of another sample period have a colour of their own.
    Directions take the noise that lies along them, all of them near the resonance; a spectrum of the leftover alone
    has a hole there, and every statistic would be too large. Under a noise model the leftover and the covariance of
    what was taken are known (generalised least squares), and both together give the next model.
    H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545, by expectation and maximisation.
    """
    outputs = rows[0].residual.shape[0]
    models = [NoiseModel(np.empty(0), 1.0)] * outputs
    groups = group_by_period([row.period_s for row in rows])
    samples = [sum(rows[k].residual.shape[1] for k in own) for own in groups]
    for turn in range(RESTRICTED_TURNS + slow):
        split = [row.apart(models) for row in rows]
        taken, half = least_squares(np.sum([part.gram for part in split], axis=0))
        weights = np.append(1.0, -taken)[None]
        if turn > 0:  # the first model's unit is not that of the noise
            weights = np.vstack((weights, np.pad(half, ((0, 0), (1, 0)))))
        models = []
        for o in range(outputs):
            series = [
                _known(row, part, weights, o, whole=turn > 0) for row, part in zip(rows, split, strict=True)
            ]
            made = [
                fit_noise_with_slow_part([series[k] for k in own], slow=slow and turn > 0)._replace(
                    period_s=rows[own[0]].period_s
                )
                for own in groups
            ]
            models.append(combine_models(made, samples))
    return models


def _known(row: Rows, part: Apart, weights: FloatArray, output: int, *, whole: bool) -> FloatArray:
    """(m, n) combinations of one output less what the own unknowns follow, and, if `whole`, what these took."""
    own = -weights @ part.followed
    if whole:
        weights = np.vstack((weights, np.zeros((len(part.half), weights.shape[1]))))
        own = np.vstack((own, part.half))
    return row.combined(weights, own, output)


def least_squares(gram: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights (p + k,) of all directions together, and H (rank, p + k) of which H^T H is their covariance."""
    scale = _sizes(gram)
    normal = gram / scale[:, None] / scale
    values, vectors = np.linalg.eigh(normal[1:, 1:])
    good = values > 1e-10 * values[-1] if len(values) else np.zeros(0, bool)
    half = (vectors[:, good] / np.sqrt(values[good])).T / scale[1:]
    return half.T @ (half @ gram[1:, 0]), half
