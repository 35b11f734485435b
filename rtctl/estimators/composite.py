"""The paper's composite: resistance -> inverse GPI -> temperature surrogate -> EGPI -> deflection.

Zhang et al., IEEE/ASME Trans. Mechatronics 21(5), 2016, equations (13) to (15). State: that of the inverse, then
the plays of the EGPI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rtctl.hysteresis.egpi import EgpiParams, egpi_step
from rtctl.hysteresis.gpi_inverse import GpiInverse, GpiInverseParams, InverseStep, gpi_inverse_step
from rtctl.interfaces import Estimate
from rtctl.kernels import FloatArray, kernel
from rtctl.models.vo2 import Vo2Model

SURROGATE_MARGIN = 0.1  # of the identified current range: beyond it an inverse near saturation says nothing


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
    """Deflection [um], surrogate [mA], d surrogate / d u [mA] and status; both states advance in place.

    `low`, `high` [mA] clip the surrogate between the halves.
    """
    found: InverseStep = gpi_inverse_step(inverse_state, -1e-3 * resistance_ohm, inverse)
    v = min(max(found.v, low), high)
    return egpi_step(plays, v, egpi), v, found.gain, found.status


class CompositeEstimator:
    """`Estimator` of the paper's composite."""

    def __init__(self, model: Vo2Model) -> None:
        margin = SURROGATE_MARGIN * model.current.width
        self._clip = (model.current.low - margin, model.current.high + margin)
        self._inverse = GpiInverse.of(model.resistance_gpi)
        self._egpi = model.composite_egpi
        self._params, self._egpi_params = self._inverse.params, self._egpi.params
        self._fit_rms = model.quality["composite"].rms
        steepness = model.deflection.width / model.current.width
        self._reading = 1e-3 * model.reading_error / float(model.resistance_gpi.p[0]) * steepness
        self._inverse_state: FloatArray = np.empty(0)
        self._plays: FloatArray = np.empty(0)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """From a full cooling."""
        self._inverse_state = self._inverse.initial_state(levels[0])
        self._plays = self._egpi.initial_state(levels[0])
        return self.step(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """One sample; the current is not used."""
        value, surrogate, gain, status = composite_step(
            self._inverse_state, self._plays, sensed[0], *self._clip, self._params, self._egpi_params
        )
        return Estimate(value, surrogate, math.hypot(self._fit_rms, self._reading * sensed[0] * gain), status)
