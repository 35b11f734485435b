"""Thermal observer: the known current predicts the temperature, the resistance corrects it, Preisach gives deflection.

    ds/dt = (i^2 + b - s) / tau,   v = sqrt(s),   deflection = D(v; history)
    -ln R = H(v; history) + m + noise

s [mA^2] is the temperature rise as a current's square, b [mA^2] heat that the model does not know (ambient drift, a
changed gain; 1 mA^2 is about 1 degC), a random walk; m [ln ohm] is the error of the resistance model. A model's error
is no white noise: it changes along the path (r = exp(-|dv| / L), stationary variance sigma_m^2) and stays while the
device stays, so holding still teaches nothing more about b however often the resistance is read.

The sensitivity of the reading to b is taken between two resistance models side by side, one at b and one at b +
`PROBE_MA2`, each with its own history. The local slope of H will not do: it has one value going up and another going
down, and a filter that is shown both for the same state believes that it can tell b from m. (Nor will correcting v
by every reading: the hysteresis rectifies the noise, and the estimate creeps.)
A reading that is off by more than `DISAGREEMENT` standard deviations is no normal error but a wrong reading or a late
device: it counts as if its noise were that large, so that its influence falls with its distance (a Kalman filter with
heavy-tailed noise; G. Agamennoni, J. Nieto, E. Nebot, IEEE Trans. Signal Process. 60 (2012) 5024). Taken as it stands,
one such reading would be believed to be heat, with certainty, for hours.
In the small loops of a closed loop m keeps its sign, which no variance expresses; so an estimated b is acted on only as
far as it exceeds what m can feign (`believed`).
Kalman filter of (b, m) with one scalar measurement. State order: s, probed s, b, m, P_bb, P_bm, P_mm and the last H;
then the stacks of H, of probed H and of D.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import exp, log
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.film_memory import FilmMemory
from rtctl.hysteresis.packing import array_at, number_at, pack, preisach_at
from rtctl.hysteresis.preisach.model import PreisachParams, preisach_slope, preisach_step
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.models.vo2 import SURROGATE, Vo2Model

PROBE_MA2 = 0.1
HEAT_START_MA2 = 0.5  # what a room may differ from the day of identification
HEAT_WALK_MA2 = 0.01  # a square root of a second: a tenth of a degree a minute
MODEL_ERROR_FACTOR = 6.0  # the rms over all data understates the error where a model is worst
ERROR_LENGTH = 0.05  # of the current range: over what path the resistance model's error changes
READING_SHARE = 0.3  # of the model's rms error that is noise of a single reading
STEEPNESS = 3.0
DISAGREEMENT = 6.0  # standard deviations
EXPECTED = 7
"""Place of the last H in the filter's state, without the model's error m: the reading that the model alone expects."""
OUT_OF_RANGE, NOT_FINITE, DISAGREES = (
    int(EstimateStatus.OUT_OF_RANGE),
    int(EstimateStatus.NOT_FINITE),
    int(EstimateStatus.DISAGREES),
)


class ObserverParams(NamedTuple):
    """Parameters of the kernel besides the Preisach models."""

    time_constant_s: float
    reading_variance: float
    """Variance of one reading of -ln R about the model and its error m."""
    model_variance: float
    """Variance of the model's error, sigma_m^2."""
    error_length: float
    """Length L over which the model's error changes [mA]."""
    heat_walk: float
    """Variance that b gains per second [mA^4/s]."""
    low: float
    """Range of v in which the models were identified [mA]."""
    high: float
    heat_faked: float
    """Heat b0 that the resistance model's error can feign [mA^2]."""


RESISTANCE_PART = 4 + len(ObserverParams._fields)
DEFLECTION_PART = RESISTANCE_PART + len(PreisachParams._fields)


@kernel
def believed(b: float, heat_faked: float) -> float:
    """Return the part of an estimated b that is acted on [mA^2]: b^3 / (b^2 + b0^2), little below b0, all far above."""
    if heat_faked == 0.0:
        return b
    return b * b * b / (b * b + heat_faked * heat_faked)


@kernel
def propagate(x: FloatArray, way_mA: float, elapsed_s: float, p: ObserverParams) -> None:
    """Propagate m and the covariances over `elapsed_s` [s], in which v moved by `way_mA`, in place."""
    r = exp(-way_mA / p.error_length)
    x[3] *= r
    x[4] += p.heat_walk * elapsed_s
    x[5] *= r
    x[6] = r * r * x[6] + (1.0 - r * r) * p.model_variance


@kernel
def predict(x: FloatArray, current_mA: float, elapsed_s: float, p: ObserverParams) -> float:
    """Advance x (state order above) by `elapsed_s` of a held current, in place; returns v [mA]."""
    a = exp(-elapsed_s / p.time_constant_s)
    before = math.sqrt(max(x[0], 0.0))
    power = current_mA * current_mA + believed(x[2], p.heat_faked)
    x[0] = power + (x[0] - power) * a
    x[1] = power + PROBE_MA2 + (x[1] - power - PROBE_MA2) * a
    v = math.sqrt(max(x[0], 0.0))
    propagate(x, abs(v - before), elapsed_s, p)
    return v


@kernel
def condition_on(x: FloatArray, innovation: float, sensitivity: float, variance: float) -> float:
    """Update b and m by a reading `sensitivity` b + m (Kalman); return the innovation in standard deviations.

    Of a reading beyond `DISAGREEMENT` standard deviations the variance is what puts it there.
    """
    with_b = sensitivity * x[4] + x[5]  # covariances of the states with the reading
    with_m = sensitivity * x[5] + x[6]
    believed_total = sensitivity * with_b + with_m + variance
    total = max(believed_total, innovation * innovation / (DISAGREEMENT * DISAGREEMENT))
    x[2] += with_b * innovation / total
    x[3] += with_m * innovation / total
    x[4] -= with_b * with_b / total
    x[5] -= with_b * with_m / total
    x[6] -= with_m * with_m / total
    return abs(innovation) / math.sqrt(believed_total)


# 10 parameters because a kernel takes its arrays one by one
@kernel
def observer_step(  # noqa: PLR0913
    x: FloatArray,
    stack: FloatArray,
    probed_stack: FloatArray,
    deflection_stack: FloatArray,
    current_mA: float,
    resistance_ohm: float,
    elapsed_s: float,
    p: ObserverParams,
    resistance: PreisachParams,
    deflection: PreisachParams,
) -> tuple[float, float, float, int]:
    """Take one step of the filter; advance its state and the stacks in place.

    Args:
        x: state of the filter (8,).
        stack: relays of the resistance model at the surrogate.
        probed_stack: the same a little warmer, for the sensitivity.
        deflection_stack: relays of the deflection model.
        current_mA: the current that was held [mA].
        resistance_ohm: the reading [ohm]; NaN: none.
        elapsed_s: time since the sample before [s].
        p: parameters of the filter.
        resistance: parameters of the resistance model.
        deflection: parameters of the deflection model.

    Returns:
        Deflection [um], surrogate [mA], standard error [um] through b alone, status.
    """
    v = predict(x, current_mA, elapsed_s, p)
    status = OUT_OF_RANGE if v < p.low or v > p.high else 0
    x[EXPECTED] = expected = preisach_step(stack, v, resistance).y
    probed = preisach_step(probed_stack, math.sqrt(max(x[1], 0.0)), resistance).y
    if resistance_ohm > 0.0 and math.isfinite(resistance_ohm):
        sensitivity = (probed - expected) / PROBE_MA2
        withheld = x[2] - believed(x[2], p.heat_faked)
        innovation = -log(resistance_ohm) - (expected + sensitivity * withheld) - x[3]
        if condition_on(x, innovation, sensitivity, p.reading_variance) > DISAGREEMENT:
            status |= DISAGREES
    else:
        status |= NOT_FINITE
    value = preisach_step(deflection_stack, v, deflection).y
    slope = preisach_slope(deflection_stack, deflection)
    return value, v, abs(slope) * math.sqrt(max(x[4], 0.0)) / (2.0 * max(v, 1e-9)), status


@kernel
def packed_observer_step(
    memory: FloatArray, current_mA: float, resistance_ohm: float, elapsed_s: float
) -> tuple[float, float, float, int]:
    """Take `observer_step` in a packed memory: x, the three stacks, then the parameters of each in turn."""
    p = ObserverParams(
        number_at(memory, 4), number_at(memory, 5), number_at(memory, 6), number_at(memory, 7),
        number_at(memory, 8), number_at(memory, 9), number_at(memory, 10), number_at(memory, 11),
    )  # fmt: skip
    return observer_step(
        array_at(memory, 0), array_at(memory, 1), array_at(memory, 2), array_at(memory, 3),
        current_mA, resistance_ohm, elapsed_s, p,
        preisach_at(memory, RESISTANCE_PART), preisach_at(memory, DEFLECTION_PART),
    )  # fmt: skip


def _steep_slope(model: Vo2Model) -> float:
    """Return -d ln R / ds where the film switches [1/mA^2]: about `STEEPNESS` times the mean over the range."""
    span = model.current.high**2 - model.current.low**2
    return STEEPNESS * math.log(model.resistance.high / model.resistance.low) / span


def observer_params(model: Vo2Model) -> ObserverParams:
    """Return the parameters of an identified model."""
    margin = 0.02 * model.current.width
    return ObserverParams(
        model.time_constant_s,
        (READING_SHARE * model.reading_error) ** 2,
        (MODEL_ERROR_FACTOR * model.reading_error) ** 2,
        ERROR_LENGTH * model.current.width,
        HEAT_WALK_MA2**2,
        model.current.low - margin,
        model.current.high + margin,
        MODEL_ERROR_FACTOR * model.reading_error / _steep_slope(model),
    )


def filter_start(params: ObserverParams, s: float = 0.0) -> FloatArray:
    """Return x at rest at a power s [mA^2], with b and m known by their sizes only."""
    return np.array([s, s + PROBE_MA2, 0.0, 0.0, HEAT_START_MA2**2, 0.0, params.model_variance, 0.0])


class ObserverEstimator:
    """The thermal observer of an identified model."""

    surrogate = SURROGATE

    def __init__(self, model: Vo2Model) -> None:
        self._params = observer_params(model)
        self._resistance, self._deflection = model.resistance_preisach, model.deflection_preisach
        self.fit_error = model.deflection_error
        self.reading_error = model.reading_error
        """RMS error of the model's reading [ln ohm]."""
        self._memory = self._packed(model.current.low)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start at rest at the applied current, from a full cooling; see `Estimator`."""
        self._memory = self._packed(float(levels[0]))
        return self.step(levels, sensed, 0.0)

    def _packed(self, current: float) -> FloatArray:
        s = current * current
        return pack(
            filter_start(self._params, s),
            self._resistance.initial_state(current),
            self._resistance.initial_state(math.sqrt(s + PROBE_MA2)),
            self._deflection.initial_state(current),
            self._params,
            self._resistance.params,
            self._deflection.params,
        )

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        return self.estimate_of(*packed_observer_step(self._memory, levels[0], sensed[0], elapsed_s))

    def model_reading(self) -> float:
        """Return the reading that the model alone expected last, -ln R [ln ohm]."""
        return float(array_at(self._memory, 0)[EXPECTED])

    @property
    def memory(self) -> FloatArray:
        """The memory that `packed_observer_step` advances, until the next start."""
        return self._memory

    def film_memory(self) -> FilmMemory:
        """See `Remembering`."""
        x, film, hotter, beam = (np.array(array_at(self._memory, k)) for k in range(4))
        return FilmMemory(float(x[0]), film, beam, float(x[1]), hotter, beam.copy(), x[2:])

    def inherit(self, memory: FilmMemory) -> None:
        """See `Inheriting`."""
        x, film, hotter, beam = (array_at(self._memory, k) for k in range(4))
        x[:] = filter_start(self._params, memory.power)
        x[1], x[2 : 2 + memory.filter.size] = memory.hotter, memory.filter
        film[:], hotter[:], beam[:] = memory.film, memory.hotter_film, memory.beam

    def estimate_of(self, value: float, surrogate: float, error: float, status: int) -> Estimate:
        """Return what the kernel computed as an estimate; its error is through b alone."""
        return Estimate(value, surrogate, math.sqrt(error * error + self.fit_error * self.fit_error), status)
