"""The paper's baselines: one hysteresis model straight from -ln R to deflection, without a temperature between."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

from rtctl.arithmetic.elementary import log
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.egpi import EgpiModel, egpi_step
from rtctl.hysteresis.packing import array_at, egpi_at, pack, preisach_at
from rtctl.hysteresis.preisach.model import PreisachModel, preisach_step
from rtctl.interfaces import Estimate, EstimateStatus
from rtctl.models.span import Span
from rtctl.models.vo2 import SURROGATE, Vo2Model

OK, NOT_FINITE, OUT_OF_RANGE = (
    int(status) for status in (EstimateStatus.OK, EstimateStatus.NOT_FINITE, EstimateStatus.OUT_OF_RANGE)
)
READING_MARGIN = 0.1  # of the identified range of ln R: beyond it the memoryless term would run away


@kernel
def packed_egpi_step(memory: FloatArray, u: float) -> float:
    """Take `egpi_step` in a packed memory: plays, parameters."""
    return egpi_step(array_at(memory, 0), u, egpi_at(memory, 1))


@kernel
def packed_preisach_step(memory: FloatArray, u: float) -> tuple[float, int]:
    """Take `preisach_step` in a packed memory: stack, parameters."""
    step = preisach_step(array_at(memory, 0), u, preisach_at(memory, 1))
    return step.y, step.status


@kernel
def clipped_reading(resistance_ohm: float, low: float, high: float, margin: float) -> tuple[float, int]:
    """Return -ln R, clipped `margin` beyond low to high [ln ohm], and its status; NaN if there is no reading."""
    if not 0.0 < resistance_ohm < math.inf:
        return math.nan, NOT_FINITE
    u = -log(resistance_ohm)
    return min(max(u, low - margin), high + margin), OK if low <= u <= high else OUT_OF_RANGE


def reading_range(model: Vo2Model) -> Span:
    """Return the identified range of -ln R [ln ohm]."""
    return Span(-math.log(model.resistance.high), -math.log(model.resistance.low))


class _Direct(ABC):
    """The shared part of both estimators: the reading and its range, and the memory of the hysteresis model."""

    surrogate = SURROGATE

    def __init__(self, model: Vo2Model, hysteresis: EgpiModel | PreisachModel, fit: str) -> None:
        self._error = model.quality[fit].rms
        self._range = reading_range(model)
        self._model = hysteresis
        self._memory = self._packed()
        self._last = 0.0

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start from a full cooling; see `Estimator`."""
        self._memory = self._packed()
        return self.step(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample; the current is not used."""
        low, high = self._range
        u, status = clipped_reading(sensed[0], low, high, READING_MARGIN * self._range.width)
        value, clipped = self._advance(u)
        if math.isfinite(value):
            self._last = value
        return Estimate(self._last, math.nan, self._error, status | clipped)

    @abstractmethod
    def _advance(self, u: float) -> tuple[float, int]:
        """Return the deflection [um] at -ln R = u, and the status of that; advance the memory."""

    def _packed(self) -> FloatArray:
        """Return the memory after a full cooling."""
        return pack(self._model.initial_state(self._range.low), self._model.params)


class DirectEgpiEstimator(_Direct):
    """The estimator by an EGPI on -ln R."""

    def __init__(self, model: Vo2Model) -> None:
        super().__init__(model, model.direct_egpi, "direct_egpi")

    def _advance(self, u: float) -> tuple[float, int]:
        return packed_egpi_step(self._memory, u), OK


class DirectPreisachEstimator(_Direct):
    """The estimator by a Preisach model with ten levels on -ln R."""

    def __init__(self, model: Vo2Model) -> None:
        super().__init__(model, model.direct_preisach, "direct_preisach")

    def _advance(self, u: float) -> tuple[float, int]:
        return packed_preisach_step(self._memory, u)
