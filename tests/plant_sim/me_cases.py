"""ME resonators with single keys of their file replaced, and the equations that they should obey, written out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from me_plants import SILENT, me_file
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from plant_sim.resonator.device_file import MeDeviceFile
from plant_sim.resonator.plant import MeResonator

FloatArray = NDArray[np.float64]

__all__ = ["SILENT", "me_file", "phasor", "settled", "silent", "solved"]


def silent(name: str = "me_a", keys: dict[str, Any] | None = None) -> MeResonator:
    """A device without noise and rounding."""
    return MeResonator(me_file(name, SILENT | (keys or {})))


def solved(device: MeDeviceFile, holds: Sequence[tuple[float, float, float]]) -> FloatArray:
    """State (i [A], z [um], v [um/s]) at the end of holds of (mA, Hz, s), by SciPy from the equations."""
    coil, film, beam = device.coil, device.magnetisation, device.beam
    omega = 2.0 * math.pi * beam.frequency
    state, phase = np.zeros(3), 0.0
    for current_mA, frequency_hz, duration_s in holds:

        def slope(
            t: float, y: FloatArray, asked: float = 1e-3 * current_mA, f: float = frequency_hz,
            start: float = phase,
        ) -> list[float]:  # fmt: skip
            i, z, v = y
            field = coil.field * i / (4e-7 * math.pi)  # A/m
            a = 3.0 * film.susceptibility * field / film.saturation
            m = film.saturation * (1.0 / np.tanh(a) - 1.0 / a if abs(a) > 1e-3 else a / 3.0)
            voltage = coil.resistance * asked * math.cos(start + 2.0 * math.pi * f * t)
            restoring = omega**2 * z + beam.stiffness_cubic * z**3 + beam.stiffness_quintic * z**5
            return [
                (voltage - coil.resistance * i) / coil.inductance,
                v,
                beam.drive * m - omega / beam.quality * v - restoring,
            ]

        found = solve_ivp(
            slope, (0.0, duration_s), state, method="DOP853", rtol=1e-10, atol=1e-12, max_step=1e-5
        )
        state, phase = found.y[:, -1], phase + 2.0 * math.pi * frequency_hz * duration_s
    return state


def phasor(reading: tuple[tuple[float, ...], float]) -> complex:
    """X + iY of a measurement."""
    (in_phase, quadrature), _ = reading
    return complex(in_phase, quadrature)


def settled(plant: MeResonator, current_mA: float, frequency_hz: float, duration_s: float = 0.3) -> complex:
    """The lock-in's output in steady state."""
    plant.advance((current_mA, frequency_hz), duration_s)
    plant.measure()
    return phasor(plant.step((current_mA, frequency_hz), 2e-3))
