"""Estimators that have resistance alone, behind a sensor of an extended model.

    R = Y + tau_r Y'           exact where R is constant over a sample: (Y_k - a Y_(k-1)) / (1 - a), a = exp(-h / tau_r)
    R_film = (R - leak (i - known v)) / exp(ageing t + bend t^2)

and -ln R by its correction back to what the loops were identified on; v is the estimate's own last surrogate. Taking a
lag back costs noise, (1 + a^2)^(1/2) / (1 - a) of it. The deflection is the loops' corrected forward; a beam that
swings is not followed, for that takes the temperature between the readings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rtctl.interfaces import Estimate, Estimator
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics


class CorrectedEstimator:
    """An estimator that gives another one the film's own resistance."""

    def __init__(self, inner: Estimator, dynamics: Vo2Dynamics) -> None:
        self.surrogate = inner.surrogate
        self._inner = inner
        self._dynamics = dynamics
        self._time_s = 0.0
        self._last = self._v = math.nan

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start from a full cooling; see `Estimator`."""
        self._time_s, self._last, self._v = 0.0, sensed[0], levels[0]
        return self._corrected(self._inner.start(levels, [self._film(levels[0], sensed[0])]))

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        self._time_s += elapsed_s
        reading, lag_s = sensed[0], self._dynamics.sensor_lag_s
        if lag_s > 0.0 and elapsed_s > 0.0 and math.isfinite(reading) and math.isfinite(self._last):
            kept = math.exp(-elapsed_s / lag_s)
            self._last, reading = reading, (reading - kept * self._last) / (1.0 - kept)
        film = self._film(levels[0], reading)
        return self._corrected(self._inner.step(levels, [film], elapsed_s))

    def _film(self, current: float, reading: float) -> float:
        """Return what the film would read without the sensor's errors [ohm]; NaN of no resistance."""
        dynamics = self._dynamics
        v = self._v if math.isfinite(self._v) else current
        own = (reading - dynamics.leak * (current - dynamics.leak_known * v)) * math.exp(
            -(dynamics.ageing + dynamics.ageing_bend * self._time_s) * self._time_s
        )
        if not 0.0 < own < math.inf:
            return math.nan
        return math.exp(-dynamics.reading.back(-math.log(own)))

    def _corrected(self, estimate: Estimate) -> Estimate:
        self._v = estimate.surrogate
        gain = abs(self._dynamics.deflection.gain)
        return estimate._replace(
            value=self._dynamics.deflection.of(estimate.value), confidence=gain * estimate.confidence
        )
