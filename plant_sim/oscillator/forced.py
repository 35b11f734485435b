"""Oscillators under harmonic drive, each lane with a frequency and an amplitude of its own.

Time in periods of the lane's drive and the drive in its amplitudes: with tau = f t and w = dz/dtau = v / f,

    d2z/dtau2 = (gain A / f^2) cos(2 pi tau) - (damping / f) w - (stiffness + cubic z^2 + ...) / f^2 z

so that one record of drive serves lanes of all frequencies and amplitudes, and they march side by side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from plant_sim.oscillator.equation.terms import (
    CUBIC,
    DAMPING,
    DAMPING_2,
    FRICTION,
    GAIN,
    PARAMETRIC,
    QUADRATIC,
    QUINTIC,
    STIFFNESS,
)
from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.sweep import BLOCK_STEPS, Trajectories, harmonic_nodes
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import FreeParameter

LANES = 64
"""Lanes that are marched together: their state and coefficients stay in the fastest cache."""
_BY_FREQUENCY_SQUARED = (GAIN, STIFFNESS, CUBIC, QUADRATIC, QUINTIC, PARAMETRIC, FRICTION)
_BY_FREQUENCY = (DAMPING, DAMPING_2)
_BY_AMPLITUDE = (GAIN, PARAMETRIC)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForcedOscillator:
    """A model under a drive A cos(2 pi f t), in the units of its simulation."""

    parameters: tuple[FreeParameter, ...]
    mechanisms: tuple[OscillatorMechanism, ...]

    def march(
        self,
        values: FloatArray,
        frequency_hz: FloatArray,
        amplitude: FloatArray,
        state: FloatArray,
        periods: int,
        steps_per_period: int,
        rows_per_period: int = 1,
    ) -> Trajectories:
        """Return displacement and velocity (rows, lanes); row 0 is the start, at the drive's crest.

        Args:
            values: parameters (lanes, parameters).
            frequency_hz: frequency of each lane's drive (lanes,) [Hz].
            amplitude: amplitude of each lane's drive (lanes,).
            state: displacement and velocity (lanes, 2) at the start.
            periods: periods to march.
            steps_per_period: integration steps in a period.
            rows_per_period: rows returned for a period.

        Raises:
            ValueError: `rows_per_period` does not divide `steps_per_period`.
        """
        if steps_per_period % rows_per_period:
            raise ValueError(
                f"{rows_per_period} rows do not divide a period of {steps_per_period} steps; use a divisor"
            )
        lanes = len(frequency_hz)
        trajectories = Trajectories(*(np.empty((periods * rows_per_period + 1, lanes)) for _ in range(2)))
        for first in range(0, lanes, LANES):
            part = slice(first, first + LANES)
            equation = self._in_periods(values[part], frequency_hz[part], amplitude[part])
            z, w = state[part, 0].copy(), state[part, 1] / frequency_hz[part]
            displacement, speed = _march(equation, z, w, periods, steps_per_period, rows_per_period)
            trajectories.displacement[:, part] = displacement
            trajectories.velocity[:, part] = speed * frequency_hz[part]
        return trajectories

    def fastest_hz(self, values: FloatArray, reach: float, drive: float) -> float:
        """Return the frequency [Hz] of the models' fastest pole for motions up to `reach` under drives up to `drive`.

        The reach is at least the distance of the wells.
        """
        equation = Equation.of(self.parameters, self.mechanisms, values)
        return equation.rates(max(reach, equation.rest()), drive)[0] / (2.0 * np.pi)

    def _in_periods(self, values: FloatArray, frequency_hz: FloatArray, amplitude: FloatArray) -> Equation:
        """Return the equation in units of periods and amplitudes."""
        equation = Equation.of(self.parameters, self.mechanisms, values)
        rows = equation.rows
        for row in _BY_FREQUENCY_SQUARED:
            rows[row] /= frequency_hz**2
        for row in _BY_FREQUENCY:
            rows[row] /= frequency_hz
        for row in _BY_AMPLITUDE:
            rows[row] *= amplitude
        return equation


def _march(
    equation: Equation,
    z: FloatArray,
    w: FloatArray,
    periods: int,
    steps_per_period: int,
    rows_per_period: int,
) -> tuple[FloatArray, FloatArray]:
    """March lanes that fit the cache, so many periods at a time that the drive fits it too."""
    substeps = steps_per_period // rows_per_period
    displacement, speed = (np.empty((periods * rows_per_period + 1, len(z))) for _ in range(2))
    block = min(periods, max(1, BLOCK_STEPS // steps_per_period))
    nodes = harmonic_nodes(1.0, block, steps_per_period)
    for first in range(0, periods, block):
        count = min(block, periods - first)
        rows = slice(first * rows_per_period, (first + count) * rows_per_period + 1)
        drive = Driven(nodes[: count * steps_per_period], 1.0 / steps_per_period)
        equation.march(z, w, drive, substeps, (displacement[rows], speed[rows]))
    return displacement, speed


def forced_model(model: ModelFile, units: Mapping[str, str], source: str) -> ForcedOscillator:
    """Return an oscillator's `model` under harmonic drive, bound to `units`. Raises InputError that names `source`."""
    return forced_oscillator(oscillator_simulation(model, units, source), source)


def forced_oscillator(simulation: OscillatorSimulation, source: str) -> ForcedOscillator:
    """Return the model of a simulation. Raises InputError if something in it is not the same in every period."""
    refused = [one.id for one in simulation.mechanisms if not _fits(one)]
    if refused:
        raise InputError(
            f"{source}: {', '.join(refused)} cannot be swept: it acts on the drive or the reading, remembers or "
            "drifts; take it out of the model, or simulate records with `rtctl simulate`"
        )
    return ForcedOscillator(parameters=simulation.parameters, mechanisms=simulation.mechanisms)


def _fits(mechanism: OscillatorMechanism) -> bool:
    """Return whether a term of the equation is the same in every period."""
    outside: Sequence[object] = (mechanism.input, mechanism.drive, mechanism.sensor, mechanism.memory)
    return all(part is None for part in outside) and "drift" not in mechanism.terms
