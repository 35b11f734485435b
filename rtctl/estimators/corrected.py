"""Estimators that have resistance alone, behind a sensor of an extended model.

    R = Y + tau_r Y'           exact where R is constant over a sample: (Y_k - a Y_(k-1)) / (1 - a), a = exp(-h / tau_r)
    R_film = (R - leak (i - known v)) / (1 + ageing d ln(1 + t / d))

and -ln R by its correction back to what the loops were identified on; v is the estimate's own last surrogate. Taking a
lag back costs noise, (1 + a^2)^(1/2) / (1 - a) of it. The deflection is the loops' corrected forward; a beam that
swings is not followed, for that takes the temperature between the readings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import exp, log
from rtctl.border.arrays import FloatArray
from rtctl.estimators.drive import later
from rtctl.interfaces import Estimate, Estimator
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics
from rtctl.simulations.vo2.mechanisms.sensor.ageing import slowed_s

LAST, SURROGATE, CLOCK = 0, 1, 2
"""Memory: the last finite reading [ohm], the last surrogate [mA]; the time and its rounding [s] (`later`)."""


class SensorParams(NamedTuple):
    """Sensor of an extended model; names as in `Vo2Dynamics`."""

    lag_s: float
    leak: float
    """[ohm/mA]."""
    leak_known: float
    ageing: float
    """[1/s]."""
    ageing_slowing_s: float
    reading_gain: float
    reading_offset: float
    deflection_gain: float
    deflection_offset: float
    """[um]."""


def sensor_params(dynamics: Vo2Dynamics) -> SensorParams:
    """Return the parameters of a model's sensor."""
    numbers = (
        dynamics.sensor_lag_s, dynamics.leak, dynamics.leak_known, dynamics.ageing, dynamics.ageing_slowing_s,
        *dynamics.reading, *dynamics.deflection,
    )  # fmt: skip
    return SensorParams(*map(float, numbers))


def sensor_at_rest(level: float) -> FloatArray:
    """Return the memory at a level [mA] before the first reading."""
    return np.array([math.nan, level, 0.0, 0.0])


def film_resistance(
    memory: FloatArray, current: float, sensed: float, elapsed_s: float, p: SensorParams
) -> float:
    """Return what the film would read without the sensor's errors [ohm], NaN of no resistance; advance the memory.

    Args:
        memory: see `LAST`.
        current: the current that was held [mA].
        sensed: the reading [ohm].
        elapsed_s: time since the reading before [s].
        p: parameters.
    """
    later(memory[CLOCK:], elapsed_s)
    reading, time_s = sensed, memory[CLOCK]
    if p.lag_s > 0.0 and elapsed_s > 0.0 and math.isfinite(sensed) and math.isfinite(memory[LAST]):
        kept = exp(-elapsed_s / p.lag_s)
        reading = (sensed - kept * memory[LAST]) / (1.0 - kept)
    if math.isfinite(sensed):
        memory[LAST] = sensed
    v = memory[SURROGATE] if math.isfinite(memory[SURROGATE]) else current
    leaked = p.leak * (current - p.leak_known * v)
    own = (reading - leaked) / (1.0 + p.ageing * slowed_s(time_s, p.ageing_slowing_s))
    if not 0.0 < own < math.inf:
        return math.nan
    return exp((log(own) + p.reading_offset) / p.reading_gain)


class CorrectedEstimator:
    """An estimator that gives another one the film's own resistance."""

    def __init__(self, inner: Estimator, dynamics: Vo2Dynamics) -> None:
        self.surrogate = inner.surrogate
        self.inner, self.params = inner, sensor_params(dynamics)
        self._memory = sensor_at_rest(math.nan)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start from a full cooling; see `Estimator`."""
        self._memory = sensor_at_rest(levels[0])
        return self._corrected(self.inner.start(levels, [self._film(levels, sensed, 0.0)]))

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        return self._corrected(self.inner.step(levels, [self._film(levels, sensed, elapsed_s)], elapsed_s))

    def _film(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> float:
        return float(film_resistance(self._memory, levels[0], sensed[0], elapsed_s, self.params))

    def _corrected(self, estimate: Estimate) -> Estimate:
        self._memory[SURROGATE] = estimate.surrogate
        gain, offset = self.params.deflection_gain, self.params.deflection_offset
        return estimate._replace(
            value=gain * estimate.value + offset, confidence=abs(gain) * estimate.confidence
        )
