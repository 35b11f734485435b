"""The resonator that the study measures: the ME paper's figures where it gives them, ours where it does not.

    z'' + c z' + k z + k3 z^3 + k5 z^5 = g B_s(t),   B_s: the field after Langevin's saturation     z [um], B [mT]

From the paper: 3 x 1 mm, first bending mode at 7.5 kHz, 2.6 mT/A, M_s = 159.15 kA/m, chi = 40, and 0.723 um of
amplitude at 0.4 mT in resonance (its 0.74476 um are 3 % above what was measured). Ours: quality 500, and a spring that
softens (k3 < 0), then hardens (k5 > 0): the backbone turns at 2.6 um.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.wiring_models import build_simulation

SENSITIVITY = 2.6
"""Sensitivity of the coil [mT/A]."""
SATURATION = 159.15e3
"""Saturation magnetisation [A/m]."""
SUSCEPTIBILITY = 40.0
MU_0 = 4e-7 * math.pi
RESONANCE_HZ = 7500.0
QUALITY = 500.0
AMPLITUDE = 0.74476 / 1.03
"""Amplitude [um] at `AMPLITUDE_FIELD`, in resonance."""
AMPLITUDE_FIELD = 0.4
"""Field [mT] of that amplitude."""
SOFTENING_HZ, HARDENING_HZ = -8.0, 0.6
"""Backbone: f0 + SOFTENING_HZ a^2 + HARDENING_HZ a^4, a in um (first harmonic)."""
SAMPLE_RATE_HZ = 125e3
NOISE_DENSITY = 2e-6
"""One-sided noise density of the vibrometer [um/Hz^0.5]."""
UNITS = {"drive": "mT", "displacement": "um"}

OMEGA0 = 2.0 * math.pi * RESONANCE_HZ
DAMPING = OMEGA0 / QUALITY
STIFFNESS = OMEGA0**2
CUBIC = STIFFNESS * 8.0 / 3.0 * SOFTENING_HZ / RESONANCE_HZ
QUINTIC = STIFFNESS * 16.0 / 5.0 * HARDENING_HZ / RESONANCE_HZ
GAIN = OMEGA0 * DAMPING * AMPLITUDE / AMPLITUDE_FIELD
"""Drive gain [um/s^2/mT]."""
ARGUMENT = 3.0 * SUSCEPTIBILITY * 1e-3 / (MU_0 * SATURATION)
"""Argument of Langevin's function per field [1/mT]."""
NOISE = NOISE_DENSITY * math.sqrt(SAMPLE_RATE_HZ / 2.0)
"""Standard deviation of a sample [um]."""


def model(*, nominal: bool = False, **changed: float) -> ModelFile:
    """Return the device as a model file; `nominal`: linear and cubic terms alone, as in Duffing's equation."""
    numbers = {
        "damping": (DAMPING, "1/s"),
        "stiffness": (STIFFNESS, "1/s^2"),
        "stiffness_cubic": (CUBIC, "1/(um^2*s^2)"),
        "drive_gain": (GAIN, "um/(s^2*mT)"),
    }
    parameters = {
        name: {"value": changed.get(name, value), "unit": unit} for name, (value, unit) in numbers.items()
    }
    extra: list[dict[str, Any]] = [
        {"id": "drive.saturation", "parameters": {"curvature": {"value": ARGUMENT**2, "unit": "1/mT^2"}}},
        {
            "id": "stiffness.quintic",
            "parameters": {"coefficient": {"value": QUINTIC, "unit": "1/(um^4*s^2)"}},
        },
    ]
    tables = {"kind": "oscillator", "parameters": parameters, "mechanisms": [] if nominal else extra}
    return ModelFile.model_validate({"model": tables})


def simulation(file: ModelFile) -> Simulation:
    """Return the simulation of `file` in mT and um."""
    return build_simulation(file, UNITS, "the study's resonator")


def tone(field_mT: float, frequency_hz: float, duration_s: float) -> Stimulus:
    """Return a tone B cos(2 pi f t) that starts at t = 0."""
    time_s = np.arange(round(duration_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
    return stimulus(field_mT * np.cos(2.0 * math.pi * frequency_hz * time_s))


def stimulus(field: FloatArray) -> Stimulus:
    """Return a stimulus of a field [mT] at the sample rate, band-limited between its samples."""
    return Stimulus(inputs={"drive": field}, holds={"drive": "band-limited"}, period_s=1.0 / SAMPLE_RATE_HZ)


def response(driven: Stimulus, file: ModelFile | None = None) -> FloatArray:
    """Return the displacement (n,) [um] from rest, without noise."""
    simulated = simulation(file or model())
    values = np.array([[one.value for one in simulated.parameters]])
    return np.asarray(simulated.predict(driven, values).outputs["displacement"][0])


def noisy(displacement: FloatArray, seed: int, deviation: float = NOISE) -> FloatArray:
    """Add the vibrometer's white noise [um]."""
    return displacement + deviation * np.random.default_rng(seed).standard_normal(len(displacement))
