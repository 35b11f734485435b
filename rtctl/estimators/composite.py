"""The paper's composite: resistance -> inverse GPI -> temperature surrogate -> EGPI -> deflection.

Zhang et al., IEEE/ASME Trans. Mechatronics 21(5), 2016, equations (13) to (15). State: that of the inverse, then
the plays of the EGPI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rtctl.arithmetic.standard_error import combined
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.egpi import EgpiParams, egpi_step
from rtctl.hysteresis.gpi_inverse import GpiInverse, GpiInverseParams, InverseStep, gpi_inverse_step
from rtctl.hysteresis.packing import array_at, egpi_at, gpi_inverse_at, number_at, pack
from rtctl.interfaces import Estimate
from rtctl.models.vo2 import SURROGATE, Vo2Model

SURROGATE_MARGIN = 0.1  # of the identified current range: beyond it an inverse near saturation says nothing
EGPI_PART = 4 + len(GpiInverseParams._fields)


@kernel
def composite_step(
    inverse_state: FloatArray,
    plays: FloatArray,
    resistance_ohm: float,
    low: float,
    high: float,
    inverse: GpiInverseParams,
    egpi: EgpiParams,
) -> tuple[float, float, float, int]:
    """Return deflection [um], surrogate [mA], d surrogate / d u [mA] and status; advance both states in place.

    `low` and `high` [mA] clip the surrogate between the two models. A resistance that is not a number holds everything.
    """
    reading = -1e-3 * resistance_ohm if 0.0 < resistance_ohm < math.inf else math.nan
    inverted: InverseStep = gpi_inverse_step(inverse_state, reading, inverse)
    v = min(max(inverted.v, low), high)
    return egpi_step(plays, v, egpi), v, inverted.gain, inverted.status


@kernel
def packed_composite_step(memory: FloatArray, resistance_ohm: float) -> tuple[float, float, float, int]:
    """Take `composite_step` in a packed memory: both states, low and high, the inverse's parameters, the EGPI's."""
    return composite_step(
        array_at(memory, 0), array_at(memory, 1), resistance_ohm, number_at(memory, 2), number_at(memory, 3),
        gpi_inverse_at(memory, 4), egpi_at(memory, EGPI_PART),
    )  # fmt: skip


def reading_share(model: Vo2Model) -> float:
    """Return the error of deflection that the noise of a reading makes, per ohm and per d surrogate / d u [um]."""
    steepness = model.deflection.width / model.current.width
    return 1e-3 * model.reading_error / float(model.resistance_gpi.p[0]) * steepness


class CompositeEstimator:
    """The paper's composite estimator."""

    surrogate = SURROGATE

    def __init__(self, model: Vo2Model) -> None:
        margin = SURROGATE_MARGIN * model.current.width
        self._clip = (model.current.low - margin, model.current.high + margin)
        self._inverse = GpiInverse.of(model.resistance_gpi)
        self._egpi = model.composite_egpi
        self._fit_rms = model.quality["composite"].rms
        self._reading = reading_share(model)
        self._highest_ohm = model.resistance.high
        self._last_ohm = self._highest_ohm
        self._memory = self._packed(model.current.low)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start from a full cooling; see `Estimator`."""
        self._memory = self._packed(levels[0])
        self._last_ohm = self._highest_ohm
        return self.step(levels, sensed, 0.0)

    def _packed(self, v0: float) -> FloatArray:
        states = self._inverse.initial_state(v0), self._egpi.initial_state(v0)
        return pack(*states, *self._clip, self._inverse.params, self._egpi.params)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample; the current is not used."""
        value, surrogate, gain, status = packed_composite_step(self._memory, sensed[0])
        if 0.0 < sensed[0] < math.inf:
            self._last_ohm = sensed[0]
        error = combined(self._fit_rms, self._reading * self._last_ohm * gain)
        return Estimate(value, surrogate, error, status)
