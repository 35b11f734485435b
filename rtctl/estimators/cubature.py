"""Cubature Kalman filter: the controlled output from readings and commands, by a user's equations.

Points x +- sqrt(n) times the columns of L, P = L L', carry mean and covariance through the equations, each with weight
1/(2n); no derivative is taken, and no parameter spreads the points.

    predict  X = flow(points(x, P)),   x = mean X,   P = cov X + Q h
    update   K = cov(X, Z) (cov Z + R)^-1,   x = x + K (z - mean Z),   P = P - K (cov Z + R) K'

The formulas are kernels (`rtctl.estimators.equations.cubature_kernel`), which are exported to C as well.
A reading that the equations make less probable than `least_probability` counts as if its noise put it at that limit:
its influence falls with its distance, else one wrong reading would carry the states off and be believed.

Where the equations have events, each point goes through them at its own times. States that events alone change, such as
a switch, are known: they are as on the way of the mean.

References: I. Arasaratnam, S. Haykin, IEEE Trans. Automatic Control 54 (2009) 1254, equations 22 to 41; of readings far
off, G. Agamennoni, J. Nieto, E. Nebot, IEEE Trans. Signal Process. 60 (2012) 5024.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.estimators.equations.cubature_kernel import FilterParams, filter_step, room_size
from rtctl.estimators.equations.flow import move, watched_at
from rtctl.estimators.equations.gaussian import spread_points, take_moments
from rtctl.estimators.equations.laws import laws_of
from rtctl.estimators.equations.rest import state_at_rest
from rtctl.estimators.equations.step import whole_steps
from rtctl.interfaces import Estimate

PROBE = 1e-3
"""Share of a step over which it is looked where a motion goes."""


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
        self.params = filter_params(model, settings)
        self._model, self._laws = model, laws_of(model)
        n, self._count = len(model.initial), 2 * len(model.initial)
        self._x, self._l = model.initial.copy(), np.eye(n).ravel()
        self._room = np.zeros(room_size(n, len(model.sensed), len(model.outputs)))
        self._held: tuple[float, ...] = ()
        self._side = np.empty(0)
        self._switched = np.flatnonzero(model.switched)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Begin at the state that a long hold of `levels` leaves, as far as the first reading agrees with it."""
        self._x[:] = state_at_rest(self._model, levels)
        self._held = tuple(levels)
        self._side = np.sign(watched_at(self._model, self._x[None], levels))[0]
        self._l[:] = np.eye(len(self._x)).ravel()
        return self._moved(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """One sample: `levels` were applied for `elapsed_s` [s], `sensed` was measured at the end of that."""
        if len(self._side):
            self._through_events(levels, elapsed_s)
            elapsed_s = 0.0
        return self._moved(levels, sensed, elapsed_s)

    def outputs(self, levels: Sequence[float]) -> FloatArray:
        """Return all outputs (outputs,) of the model as they are believed, each in its unit."""
        found, u = np.empty(len(self._model.outputs)), self._model.input_si(levels)
        self._laws.outputs(self._x, u, self.params.parameters, found)
        return found

    def _moved(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        found = filter_step(
            self._laws.rates, self._laws.outputs, self._x, self._l, self._model.input_si(levels),
            np.array(sensed, dtype=np.float64), elapsed_s, self.params, self._room,
        )  # fmt: skip
        return Estimate(*found)

    def _through_events(self, levels: Sequence[float], elapsed_s: float) -> None:
        """Move each point through its own events; what events switch is as on the way of the mean."""
        model, held, n = self._model, self._held, len(self._x)
        points = self._room[: self._count * n]
        spread_points(self._x, self._l, self.params.scale, model.low, model.high, points)
        every = np.concatenate((points.reshape(self._count, n), self._x[None]))
        steps = whole_steps(elapsed_s, self.params.step_s)
        step_s = elapsed_s / steps
        watched = watched_at(model, every, held)
        sides = np.sign(watched)
        beyond = sides * self._side < 0.0
        if beyond.any():  # a reading moved it there: its event is yet to come if its own motion goes there
            ahead = every + PROBE * step_s * model.rates(every, held)
            coming = (watched_at(model, ahead, held) - watched) * self._side < 0.0
            sides = np.where(beyond & coming, self._side, sides)
        move(model, every, sides, levels, step_s, steps)
        self._side, self._held = sides[-1].copy(), tuple(levels)
        every[:-1, self._switched] = every[-1, self._switched]
        moved = np.ascontiguousarray(every[:-1]).ravel()
        wide = self._room[: 3 * n * n]
        take_moments(moved, self.params.scale, self.params.added, elapsed_s, self._x, self._l, wide)


def filter_params(model: StateSpace, settings: FilterSettings) -> FilterParams:
    """Return the constants of a filter."""
    return FilterParams(
        outputs=len(model.outputs),
        shown=model.shown,
        parameters=model.parameters,
        low=model.low,
        high=model.high,
        scale=settings.start,
        added=np.sqrt(settings.drift) / settings.start,
        corrected=np.where(model.switched, 0.0, 1.0),
        sensed=np.array(model.sensed, dtype=np.float64),
        noise=settings.noise,
        most=_chi_squared_limit(len(settings.noise), settings.least_probability),
        step_s=settings.step_s,
    )


def _chi_squared_limit(count: int, probability: float) -> float:
    from scipy.stats import chi2

    return float(chi2.isf(probability, count))
