"""Cubature Kalman filter: the controlled output from readings and commands, by a user's equations.

Points x +- sqrt(n) times the columns of a Cholesky factor of P carry mean and covariance through the equations, each
with weight 1/(2n); no derivative is taken, and no parameter spreads the points.

    predict  X = flow(points(x, P)),   x = mean X,   P = cov X + Q h
    update   K = cov(X, Z) (cov Z + R)^-1,   x = x + K (z - mean Z),   P = P - K (cov Z + R) K'

A reading that the equations make less probable than `least_probability` counts as if its noise put it at that limit:
its influence falls with its distance, else one wrong reading would carry the states off and be believed.

Where the equations have events, each point goes through them at its own times. States that events alone change, such as
a switch, are known: they are as on the way of the mean.

References: I. Arasaratnam, S. Haykin, IEEE Trans. Automatic Control 54 (2009) 1254, equations 22 to 41; of readings far
off, G. Agamennoni, J. Nieto, E. Nebot, IEEE Trans. Signal Process. 60 (2012) 5024.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.estimators.equations.flow import advance, move, watched_at
from rtctl.interfaces import Estimate, EstimateStatus

PROBE = 1e-3
"""Share of a step over which it is looked where a motion goes."""
JITTER = 1e-12
"""Share of each state's spread that is added to a covariance which rounding made indefinite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterSettings:
    """What the filter believes beside the equations."""

    start: FloatArray
    """Standard deviation (n,) of the states at the start [SI]."""
    drift: FloatArray
    """Spectral density (n,) of what the rates miss [SI^2/s]."""
    noise: FloatArray
    """Standard deviation (readings,) of the readings [their units], > 0."""
    step_s: float
    """Longest step of the integration [s]."""
    least_probability: float = 1e-9
    """Probability of a reading below which the filter says that it disagrees with the equations."""


class CubatureFilter:
    """`rtctl.interfaces.Estimator` of a device whose model is a user's equations."""

    def __init__(self, model: StateSpace, settings: FilterSettings) -> None:
        first = model.profile.sensed[0]
        self.surrogate = (f"innovation_{first.name}", first.unit)
        self._model, self._settings = model, settings
        self._law, self._parameters = model.law, model.parameters
        self._r = np.diag(settings.noise**2)
        self._limit = _chi_squared_limit(len(settings.noise), settings.least_probability)
        self._x, self._p = model.initial.copy(), np.diag(settings.start**2)
        self._held: tuple[float, ...] = ()
        self._side = np.empty(0)
        self._switched = np.flatnonzero(model.switched)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Begin at the state that a long hold of `levels` leaves, as far as the first reading agrees with it."""
        from rtctl.estimators.equations.rest import state_at_rest

        self._x = state_at_rest(self._model, levels)
        self._held = tuple(levels)
        self._side = np.sign(watched_at(self._model, self._x[None], levels))[0]
        self._p = np.diag(self._settings.start**2)
        return self._update(levels, sensed)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """One sample: `levels` were applied for `elapsed_s` [s], `sensed` was measured at the end of that."""
        self._predict(levels, elapsed_s)
        return self._update(levels, sensed)

    def outputs(self, levels: Sequence[float]) -> FloatArray:
        """Return all outputs (outputs,) of the model as they are believed, each in its unit."""
        return np.asarray(self._model.all_outputs(self._x[None], levels)[0])

    def _predict(self, levels: Sequence[float], elapsed_s: float) -> None:
        model, points = self._model, self._points()
        steps = max(1, math.ceil(elapsed_s / self._settings.step_s - 1e-9))
        if model.passages is None:
            advance(
                self._law, points, model.input_si(levels), self._parameters, model.low, model.high,
                elapsed_s / steps, steps,
            )  # fmt: skip
        else:
            self._through_events(points, levels, elapsed_s / steps, steps)
        self._x = points.mean(axis=0)
        self._p = _covariance(points, points) + np.diag(self._settings.drift * elapsed_s)

    def _through_events(self, points: FloatArray, levels: Sequence[float], step_s: float, steps: int) -> None:
        """Move the points in place, each through its own events; what events switch is as on the way of the mean."""
        model, every = self._model, np.concatenate((points, self._x[None]))
        watched = watched_at(model, every, self._held)
        sides = np.sign(watched)
        beyond = sides * self._side < 0.0
        if beyond.any():  # a reading moved it there: its event is yet to come if its own motion goes there
            ahead = every + PROBE * step_s * model.rates(every, self._held)
            coming = (watched_at(model, ahead, self._held) - watched) * self._side < 0.0
            sides = np.where(beyond & coming, self._side, sides)
        move(model, every, sides, levels, step_s, steps)
        self._side, self._held = sides[-1].copy(), tuple(levels)
        points[:] = every[:-1]
        points[:, self._switched] = every[-1, self._switched]

    def _update(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        z = np.asarray(sensed, dtype=np.float64)
        points = self._points()
        output = self._model.controlled(points, levels)
        if not np.isfinite(z).all():
            spread = float(output.std())
            return Estimate(float(output.mean()), math.nan, spread, int(EstimateStatus.NOT_FINITE))
        seen = self._model.readings(points, levels)
        innovation = z - seen.mean(axis=0)
        s = _covariance(seen, seen) + self._r
        surprise = float(innovation @ np.linalg.solve(s, innovation))
        s *= max(1.0, surprise / self._limit)
        gain = np.linalg.solve(s, _covariance(seen, points)).T
        toward = np.linalg.solve(s, _covariance(seen, output[:, None]))[:, 0]
        variance = float(output.var() - toward @ s @ toward)
        if len(self._switched):
            gain[self._switched] = 0.0
        self._x = np.clip(self._x + gain @ innovation, self._model.low, self._model.high)
        self._p = self._p - gain @ s @ gain.T
        status = EstimateStatus.DISAGREES if surprise > self._limit else EstimateStatus.OK
        value = float(self._model.controlled(self._x[None], levels)[0])
        return Estimate(value, float(innovation[0]), math.sqrt(max(variance, 0.0)), int(status))

    def _points(self) -> FloatArray:
        """Return the cubature points (2n, n), within the limits of the states."""
        n = len(self._x)
        p = 0.5 * (self._p + self._p.T)
        size = np.sqrt(np.maximum(np.diag(p), (JITTER * self._settings.start) ** 2))
        correlation = p / np.outer(size, size)
        if len(self._switched):
            correlation[self._switched, self._switched] = 1.0  # known: their spread is next to none
        for jitter in (0.0, JITTER, 1e-9, 1e-6, 1e-3):
            try:
                factor = np.linalg.cholesky(correlation + jitter * np.eye(n))
                break
            except np.linalg.LinAlgError:
                factor = np.eye(n)
        moved = math.sqrt(n) * (size[:, None] * factor).T
        points = np.concatenate((self._x + moved, self._x - moved))
        return np.ascontiguousarray(np.clip(points, self._model.low, self._model.high))


def _covariance(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the covariance (k, l) of points `a` (m, k) and `b` (m, l)."""
    found: FloatArray = (a - a.mean(axis=0)).T @ (b - b.mean(axis=0)) / len(a)
    return found


def _chi_squared_limit(count: int, probability: float) -> float:
    from scipy.stats import chi2

    return float(chi2.isf(probability, count))
