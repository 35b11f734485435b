"""A VO2 simulation whose resistance is told as its logarithm: errors of a film's resistance are relative ones.

Down to where noise takes over: asinh(R / 2 floor) + ln floor is ln R far above the floor and straight below it. Noise
of one size in ohm and errors in proportion to the resistance are then of one size everywhere, so that a noisy reading
of a metallic film, even one below zero, does not outweigh all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Mechanism
from rtctl.border.simulation import FreeParameter, Prediction, Simulation, Stimulus

LOG_RESISTANCE = "log_resistance"
LOWEST = 0.2
"""Share of the readings that tell the noise where the film is metallic."""
RELATIVE_ERROR = 0.01
"""Of a model's resistance: where that is the noise, the reading turns from straight to logarithmic."""
QUARTILE = 0.6745
SMALLEST = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class LogReading:
    """`Simulation` with outputs ln(R/ohm), straight below `floor` [ohm], and deflection [um]."""

    plain: Simulation
    floor: float
    outputs: tuple[str, ...] = (LOG_RESISTANCE, "deflection")

    @property
    def kind(self) -> str:
        """Kind of plant."""
        return self.plain.kind

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """Parameters of the simulation inside."""
        return self.plain.parameters

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Mechanisms of the simulation inside."""
        return self.plain.mechanisms

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the states of the simulation inside."""
        return self.plain.state

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """See `Simulation.starting`."""
        return self.plain.starting(stimulus, values)

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """See `Simulation.predict`."""
        run = self.plain.predict(stimulus, values, initial, steps_per_period, refine)
        logarithm = log_above(run.outputs["resistance"], self.floor)
        return Prediction(
            {LOG_RESISTANCE: logarithm, "deflection": run.outputs["deflection"]}, run.diverged_at
        )

    def extended(self, mechanisms: tuple[str, ...]) -> LogReading:
        """Return the same with these mechanisms at neutral."""
        return replace(self, plain=self.plain.extended(mechanisms))

    def with_values(self, values: FloatArray) -> LogReading:
        """Return the same model with `values` (parameters,) as its own."""
        return replace(self, plain=self.plain.with_values(values))


def log_above(resistance: FloatArray, floor: float) -> FloatArray:
    """ln(R/ohm) of `resistance` [ohm], straight below `floor`."""
    found: FloatArray = np.arcsinh(0.5 * resistance / floor) + np.log(floor)
    return found


def floor_of(records: Sequence[FloatArray]) -> float:
    """[ohm] Where half the noise is `RELATIVE_ERROR`: by second differences of the lowest of `records`, each (n,)."""
    lowest = float(np.quantile(np.concatenate(records), LOWEST))
    steps = [np.diff(one, 2)[one[1:-1] <= lowest] for one in records if len(one) > 2]
    noise = float(np.median(np.abs(np.concatenate(steps)))) / (QUARTILE * np.sqrt(6.0)) if steps else 0.0
    least = -min(float(one.min()) for one in records)
    return max(0.5 * noise / RELATIVE_ERROR, least, SMALLEST * float(np.median(np.concatenate(records))))


def without_logarithm(simulation: Simulation) -> Simulation:
    """Return the simulation inside a `LogReading`; any other one as it is."""
    return simulation.plain if isinstance(simulation, LogReading) else simulation
