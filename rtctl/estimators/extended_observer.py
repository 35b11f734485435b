"""The thermal observer of an extended model: the same filter around a richer prediction.

Heat b and model error m are estimated as in `rtctl.estimators.observer`, whose equations apply; what predicts the
reading is `thermal_path`, once at b and once `PROBE_MA2` hotter. Of a sensor that lags, the model's error m would be
seen for as long as the lag remembers it, which the filter would take for heat: so the lag is taken back, from the
reading and from both predictions alike, R_k = (Y_k - a Y_(k-1)) / (1 - a), a = exp(-h / tau_r), at the price of its
noise, whose variance grows by (1 + a^2) / (1 - a)^2 (Y / R)^2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rtctl.estimators.observer import (
    DISAGREEMENT,
    DISAGREES,
    NOT_FINITE,
    OUT_OF_RANGE,
    PROBE_MA2,
    believed,
    condition_on,
    filter_start,
    observer_params,
    propagate,
)
from rtctl.estimators.thermal_path import Drive, ThermalPath, path_params
from rtctl.hysteresis.preisach.model import preisach_slope
from rtctl.interfaces import Estimate
from rtctl.models.vo2 import SURROGATE, Vo2Model
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics


class SwingingEstimate(Estimate):
    """An estimate that the loop records as any other one; it knows by how much the beam swings just then."""

    swing: float
    """Part of `value` by which the beam is beyond where it settles [um]."""

    @property
    def settled(self) -> float:
        """The deflection without the swing [um], which heat cannot damp."""
        return self.value - self.swing


class ExtendedObserver:
    """The thermal observer of a model with mechanisms."""

    surrogate = SURROGATE

    def __init__(self, model: Vo2Model, dynamics: Vo2Dynamics) -> None:
        self._params = observer_params(model)
        self._deflection = model.deflection_preisach.params
        self._fit_error = model.deflection_error
        self._drive = Drive(dynamics)
        params = path_params(model, dynamics)
        self._path, self._probe = ThermalPath(model, params), ThermalPath(model, params)
        self._lag_s = dynamics.sensor_lag_s
        self._before: tuple[float, ...] = ()
        self._filter = np.zeros(7)
        self._time_s = 0.0

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start at rest at the applied current, from a full cooling; see `Estimator`."""
        current = self._drive.start(float(levels[0]))
        self._path.start(current)
        self._probe.start(self._path.current_of(self._path.power_of(current) + PROBE_MA2))
        self._filter = filter_start(self._params)
        self._time_s, self._before = 0.0, ()
        return self.step(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        p, x, before = self._params, self._filter, self._path.v
        heat = believed(float(x[2]), p.heat_faked)
        for current, duration_s in self._drive.pieces(float(levels[0]), elapsed_s):
            self._path.step(current, heat, self._time_s, duration_s)
            self._probe.step(current, heat + PROBE_MA2, self._time_s, duration_s)
            self._time_s += duration_s
        v = self._path.v
        propagate(x, abs(v - before), elapsed_s, p)
        status = OUT_OF_RANGE if v < p.low or v > p.high else 0
        status |= self._correct(float(sensed[0]), elapsed_s)
        slope = preisach_slope(self._path.beam, self._deflection)
        error = abs(slope) * math.sqrt(max(float(x[4]), 0.0)) / (2.0 * max(self._path.heating, 1e-9))
        made = SwingingEstimate(self._path.deflection, v, math.hypot(error, self._fit_error), status)
        made.swing = self._path.swing
        return made

    def _correct(self, resistance_ohm: float, elapsed_s: float) -> int:
        """Condition the filter on a reading; return status bits."""
        if not 0.0 < resistance_ohm < math.inf:
            self._before = ()
            return NOT_FINITE
        noise = self._params.reading_variance
        readings: tuple[float, ...] = (resistance_ohm, self._path.resistance, self._probe.resistance)
        before, self._before = self._before, readings
        if self._lag_s > 0.0:
            if not before or elapsed_s <= 0.0:
                return 0
            kept = math.exp(-elapsed_s / self._lag_s)
            readings = tuple(
                (now - kept * then) / (1.0 - kept) for now, then in zip(readings, before, strict=True)
            )
            noise *= (1.0 + kept * kept) / (1.0 - kept) ** 2 * (resistance_ohm / readings[1]) ** 2
        film_ohm, expected, probed = readings
        if not (film_ohm > 0.0 and expected > 0.0 and probed > 0.0):
            return 0  # noise of the lag's inversion carries no information
        x = self._filter
        sensitivity = math.log(expected / probed) / PROBE_MA2
        withheld = float(x[2]) - believed(float(x[2]), self._params.heat_faked)
        innovation = math.log(expected / film_ohm) - sensitivity * withheld - float(x[3])
        far = condition_on(x, innovation, sensitivity, noise)
        return DISAGREES if far > DISAGREEMENT else 0
