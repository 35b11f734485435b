"""Thermal observer: the known current predicts the temperature, the resistance corrects it, Preisach gives deflection.

State s = v^2 [mA^2], the temperature rise as a current's square, and b [mA^2], heat that the model does not know
(ambient drift, a changed gain), a random walk:

    s[k+1] = (i^2 + b) + (s - (i^2 + b)) exp(-h / tau),   b[k+1] = b + w,   var w = q h

The resistance enters as a measurement of s through the inverse of the Preisach model of -ln R; its variance is that
of the reading over the local slope squared, so where resistance says little (the metal, a reversal) the current
carries the estimate. The model's error is no white noise: it stays while the device stays, so a reading counts as
one of `CORRELATED_SAMPLES`. Two-state Kalman filter; Joseph's form is not needed for one scalar measurement.
State order: s, b, P_ss, P_sb, P_bb, then the two Preisach stacks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.hysteresis.preisach import PreisachParams, preisach_slope, preisach_step
from rtctl.hysteresis.preisach_inverse import preisach_invert
from rtctl.hysteresis.status import BranchPoint
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.kernels import FloatArray, kernel
from rtctl.models.vo2 import Vo2Model

CORRELATED_SAMPLES = 50.0
HEAT_START_MA2 = 1.0  # 1 mA^2 is about 1 degC: a room differs so much from the day of identification
HEAT_WALK_MA2 = 0.07  # a square root of a second: half a degree a minute
SURROGATE_WALK_MA2 = 0.5  # the same for s itself: what first-order heating leaves out
DISAGREEMENT = 5.0  # standard deviations
SATURATED, OUT_OF_RANGE, NOT_FINITE, DISAGREES = (
    int(EstimateStatus.SATURATED),
    int(EstimateStatus.OUT_OF_RANGE),
    int(EstimateStatus.NOT_FINITE),
    int(EstimateStatus.DISAGREES),
)


class ObserverParams(NamedTuple):
    """What the kernel needs besides the Preisach models."""

    time_constant_s: float
    reading_variance: float
    """Of one reading of -ln R, correlation included."""
    surrogate_walk: float
    """Variance that s gains a second [mA^4/s]."""
    heat_walk: float
    """Variance that b gains a second [mA^4/s]."""
    low: float
    """Range of v in which the models were identified [mA]."""
    high: float


@kernel
def predict(x: FloatArray, current_mA: float, elapsed_s: float, p: ObserverParams) -> None:
    """Advance x = (s, b, P_ss, P_sb, P_bb) by `elapsed_s` of a held current, in place."""
    a = math.exp(-elapsed_s / p.time_constant_s)
    power = current_mA * current_mA + x[1]
    x[0] = power + (x[0] - power) * a
    c = 1.0 - a
    p_ss, p_sb, p_bb = x[2], x[3], x[4]
    x[2] = a * a * p_ss + 2.0 * a * c * p_sb + c * c * p_bb + p.surrogate_walk * elapsed_s
    x[3] = a * p_sb + c * p_bb
    x[4] = p_bb + p.heat_walk * elapsed_s


@kernel
def condition_on(x: FloatArray, measured_s: float, variance: float) -> float:
    """Kalman update of x on a measurement of s [mA^2]; returns the innovation in standard deviations."""
    total = x[2] + variance
    innovation = measured_s - x[0]
    gain_s, gain_b = x[2] / total, x[3] / total
    x[0] += gain_s * innovation
    x[1] += gain_b * innovation
    x[4] -= gain_b * x[3]
    x[3] -= gain_s * x[3]
    x[2] -= gain_s * x[2]
    return abs(innovation) / math.sqrt(total)


@kernel
def observer_step(
    x: FloatArray,
    resistance_stack: FloatArray,
    deflection_stack: FloatArray,
    current_mA: float,
    resistance_ohm: float,
    elapsed_s: float,
    p: ObserverParams,
    resistance: PreisachParams,
    deflection: PreisachParams,
) -> tuple[float, float, float, int]:
    """Deflection [um], surrogate [mA], its standard deviation [um of deflection] and status; all in place."""
    predict(x, current_mA, elapsed_s, p)
    status = 0
    if resistance_ohm > 0.0 and math.isfinite(resistance_ohm):
        point: BranchPoint = preisach_invert(resistance_stack, -math.log(resistance_ohm), resistance)
        if point.status & SATURATED:
            status |= SATURATED  # the reading lies beyond the model: the current alone carries this sample
        elif point.slope > 0.0:
            per_s = point.slope / (2.0 * point.v)
            if condition_on(x, point.v * point.v, p.reading_variance / (per_s * per_s)) > DISAGREEMENT:
                status |= DISAGREES
    else:
        status |= NOT_FINITE
    v = math.sqrt(max(x[0], 0.0))
    if v < p.low or v > p.high:
        status |= OUT_OF_RANGE
    preisach_step(resistance_stack, v, resistance)
    value = preisach_step(deflection_stack, v, deflection).y
    slope = preisach_slope(deflection_stack, deflection)
    return value, v, abs(slope) * math.sqrt(max(x[2], 0.0)) / (2.0 * max(v, 1e-9)), status


class ObserverEstimator:
    """`Estimator` of the thermal observer."""

    def __init__(self, model: Vo2Model) -> None:
        margin = 0.02 * model.current.width
        self._params = ObserverParams(
            model.time_constant_s,
            CORRELATED_SAMPLES * model.reading_error**2,
            SURROGATE_WALK_MA2**2,
            HEAT_WALK_MA2**2,
            model.current.low - margin,
            model.current.high + margin,
        )
        self._resistance, self._deflection = model.resistance_preisach, model.deflection_preisach
        self._resistance_params, self._deflection_params = self._resistance.params, self._deflection.params
        self._fit_error = model.deflection_error
        self._x: FloatArray = np.zeros(5)
        self._resistance_stack: FloatArray = np.empty(0)
        self._deflection_stack: FloatArray = np.empty(0)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """At rest at the applied current, from a full cooling."""
        current = float(levels[0])
        self._x = np.array([current * current, 0.0, HEAT_START_MA2**2, HEAT_START_MA2**2, HEAT_START_MA2**2])
        self._resistance_stack = self._resistance.initial_state(current)
        self._deflection_stack = self._deflection.initial_state(current)
        return self.step(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """One sample."""
        value, surrogate, error, status = observer_step(
            self._x, self._resistance_stack, self._deflection_stack, levels[0], sensed[0], elapsed_s,
            self._params, self._resistance_params, self._deflection_params,
        )  # fmt: skip
        return Estimate(value, surrogate, math.hypot(error, self._fit_error), status)
