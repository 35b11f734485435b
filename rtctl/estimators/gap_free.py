"""The gap-free composite: -ln R -> inverse of a strictly rising play model -> surrogate -> EGPI -> deflection.

Between the envelopes of a GPI every temperature gives the same resistance; a reversible rising term closes that gap,
so the inverse neither guesses nor chatters. State: plays and last surrogate of the inverse, then the EGPI's plays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rtctl.arithmetic.elementary import log
from rtctl.arithmetic.standard_error import combined
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.estimators.composite import SURROGATE_MARGIN
from rtctl.hysteresis.egpi import EgpiParams, egpi_step
from rtctl.hysteresis.gap_free import GapFreeParams, gap_free_inverse_step
from rtctl.hysteresis.packing import array_at, egpi_at, gap_free_at, number_at, pack
from rtctl.hysteresis.status import BranchPoint
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.models.vo2 import SURROGATE, Vo2Model

NOT_FINITE = int(EstimateStatus.NOT_FINITE)
LEAST_SLOPE = 1e-12
INVERSE_PART = 4 + len(EgpiParams._fields)


@kernel
def gap_free_composite_step(
    inverse_state: FloatArray,
    plays: FloatArray,
    resistance_ohm: float,
    low: float,
    high: float,
    inverse: GapFreeParams,
    egpi: EgpiParams,
) -> tuple[float, float, float, int]:
    """Return deflection [um], surrogate [mA], slope -d ln R / d surrogate [1/mA], status; advance the states."""
    reading = -log(resistance_ohm) if resistance_ohm > 0.0 else math.nan
    point: BranchPoint = gap_free_inverse_step(inverse_state, reading, inverse)
    v = min(max(point.v, low), high)
    return egpi_step(plays, v, egpi), v, point.slope, point.status


@kernel
def packed_gap_free_composite_step(
    memory: FloatArray, resistance_ohm: float
) -> tuple[float, float, float, int]:
    """Take `gap_free_composite_step` in a packed memory: states, low, high, parameters of the EGPI, the inverse."""
    return gap_free_composite_step(
        array_at(memory, 0), array_at(memory, 1), resistance_ohm, number_at(memory, 2), number_at(memory, 3),
        gap_free_at(memory, INVERSE_PART), egpi_at(memory, 4),
    )  # fmt: skip


class GapFreeEstimator:
    """The gap-free composite estimator."""

    surrogate = SURROGATE

    def __init__(self, model: Vo2Model) -> None:
        margin = SURROGATE_MARGIN * model.current.width
        self._clip = (model.current.low - margin, model.current.high + margin)
        self._inverse, self._egpi = model.resistance_gap_free, model.gap_free_egpi
        self._fit_rms = model.quality["gap_free_composite"].rms
        self._reading = model.reading_error * model.deflection.width / model.current.width
        self._memory = self._packed(model.current.low)

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start from a full cooling; see `Estimator`."""
        self._memory = self._packed(levels[0])
        return self.step(levels, sensed, 0.0)

    def _packed(self, v0: float) -> FloatArray:
        states = self._inverse.initial_state(v0), self._egpi.initial_state(v0)
        return pack(*states, *self._clip, self._egpi.params, self._inverse.params)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample; the current is not used."""
        value, surrogate, slope, status = packed_gap_free_composite_step(self._memory, sensed[0])
        error = combined(self._fit_rms, self._reading / max(slope, LEAST_SLOPE))
        return Estimate(value, surrogate, error, status)
