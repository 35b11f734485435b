"""A VO2 simulation whose resistance is told as its logarithm: errors of a film's resistance are relative ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtctl.border.mechanisms import Mechanism
from rtctl.border.simulation import FreeParameter, Prediction, Simulation, Stimulus

FloatArray = NDArray[np.float64]
LOG_RESISTANCE = "log_resistance"


@dataclass(frozen=True, slots=True, kw_only=True)
class LogReading:
    """`Simulation` with outputs ln(R/ohm) and deflection [um]."""

    plain: Simulation
    outputs: tuple[str, ...] = (LOG_RESISTANCE, "deflection")

    @property
    def kind(self) -> str:
        """Of plant."""
        return self.plain.kind

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Of the simulation inside."""
        return self.plain.parameters

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Of the simulation inside."""
        return self.plain.mechanisms

    @property
    def state(self) -> tuple[str, ...]:
        """Of the simulation inside."""
        return self.plain.state

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """See `Simulation.predict`; a resistance that is not above zero has diverged."""
        run = self.plain.predict(stimulus, values, initial, steps_per_period, refine)
        resistance = run.outputs["resistance"]
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log(resistance)
        bad = ~np.isfinite(logarithm)
        first = np.where(bad.any(axis=1), bad.argmax(axis=1), -1)
        diverged = np.where(run.diverged_at >= 0, run.diverged_at, first)
        return Prediction({LOG_RESISTANCE: logarithm, "deflection": run.outputs["deflection"]}, diverged)

    def extended(self, mechanisms: tuple[str, ...]) -> LogReading:
        """The same with these mechanisms at neutral."""
        return replace(self, plain=self.plain.extended(mechanisms))

    def with_values(self, values: FloatArray) -> LogReading:
        """The same model with `values` (parameters,) as its own."""
        return replace(self, plain=self.plain.with_values(values))
