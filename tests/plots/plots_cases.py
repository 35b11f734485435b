"""Short recordings: the simulated device under a damped oscillation, and signals as a run records them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant_sim.catalogue import bundled_plant
from rtctl.signals.excitations import DampedOscillation
from rtctl.wiring import load_plant

FloatArray = NDArray[np.float64]


class SteadyStates(NamedTuple):
    """Ends of the holds."""

    current_mA: FloatArray
    resistance_ohm: FloatArray
    deflection_um: FloatArray


def damped_oscillation() -> SteadyStates:
    """The device after each 10 ms hold of a damped oscillation."""
    excitation = DampedOscillation.model_validate({"hold": "10 ms", "cycles": 8, "step": "2 %"})
    current = excitation.build(3.68, 8.49, 10e-3)
    plant = load_plant(bundled_plant("vo2_a"))
    readings = [plant.step((float(level),), 10e-3) for level in current]
    return SteadyStates(current, np.array([r for (r,), _ in readings]), np.array([d for _, d in readings]))


def run_signals(count: int, frequency_hz: float = 0.1) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Time [s] and the signals of a run that follows a sine, seeded."""
    draw = np.random.default_rng(3)
    time_s = 1e-3 * np.arange(count)
    setpoint = 30.0 + 20.0 * np.sin(2.0 * np.pi * frequency_hz * time_s)
    deflection = setpoint + 0.5 * draw.standard_normal(count)
    return time_s, {
        "setpoint": setpoint,
        "deflection": deflection,
        "estimate": deflection + 0.2 * draw.standard_normal(count),
        "resistance": 1e3 * np.exp(4.0 - deflection / 30.0),
        "current": 7.0 + 0.02 * (setpoint - 30.0),
        "estimate_standard_error": np.full(count, 0.3),
    }
