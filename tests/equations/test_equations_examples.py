"""The shipped models: each is short, and its free run is that of SciPy on equations that are written here again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus

EXAMPLES = Path(__file__).resolve().parents[2] / "scenarios" / "models" / "equations"
Rates = Callable[[float, FloatArray, float], list[float]]
Read = Callable[[FloatArray], FloatArray]


def tanks(t: float, x: FloatArray, u: float) -> list[float]:
    """Lengths in cm."""
    one, two = np.sqrt(np.maximum(x, 0.0))
    spill = 0.1 * max(x[0] - 10.0, 0.0)
    return [0.05 * u - 0.05 * one - spill, 0.05 * one + 0.3 * spill - 0.05 * two]


def pendulum(t: float, x: FloatArray, u: float) -> list[float]:
    angle, speed = x
    return [speed, (u - 0.004 * speed - 0.02 * np.tanh(speed / 0.05)) / 0.02 - 30.0 * np.sin(angle)]


def motor(t: float, x: FloatArray, u: float) -> list[float]:
    current, speed = x
    friction = (0.01 + 0.01 * np.exp(-((speed / 5.0) ** 2))) * np.tanh(speed) + 1e-4 * speed
    return [(u - 2.0 * current - 0.05 * speed) / 2e-3, (0.05 * current - friction) / 2e-4]


def body(t: float, x: FloatArray, u: float) -> list[float]:
    inside, outside = x
    loss = 0.1 * (outside - 293.15) + 1e-9 * (outside**4 - 293.15**4)
    return [(u - 0.5 * (inside - outside)) / 20.0, (0.5 * (inside - outside) - loss) / 80.0]


def circuit(t: float, x: FloatArray, u: float) -> list[float]:
    """Flux in Wb, charge in C."""
    flux, charge = x
    current = flux / 0.1 + 50e-3 / 1e-9 * flux**3
    return [u - 50.0 * current - charge / 1e-6, current]


def coil(t: float, x: FloatArray, u: float) -> list[float]:
    """Position in mm, the rest in SI."""
    i, z, v = x
    bl, k = 6.0 * (1.0 - 0.02 * z - 0.012 * z**2), 1500.0 * (1.0 + 0.03 * z + 0.015 * z**2)
    slope = -1e-3 * 60.0  # H/m
    force = bl * i + 0.5 * slope * i**2 - k * 1e-3 * z - 1.5 * v
    return [(u - 6.0 * i - bl * v - slope * i * v) / (1e-3 * (1.0 - 0.06 * z)), 1e3 * v, force / 15e-3]


def stack(t: float, x: FloatArray, u: float) -> list[float]:
    """Position in um, speed in mm/s."""
    volt, h, crept, z, v = x
    slope = (u - volt) / 1e-4
    turned = 0.04 * (abs(slope) * h + 0.2 * slope * abs(h))
    force = 10.0 * (volt - h + crept) - 0.3 * v - 60.0 * z
    return [slope, 0.25 * slope - turned, 0.05 * (volt - h) - crept, 1e3 * v, 1e3 * force / 0.2]


def wire(t: float, x: FloatArray, u: float) -> list[float]:
    warm, m = x
    warming = (u**2 * (4.0 + 0.8 * m) - 0.012 * (warm - 298.0)) / 0.008
    if warming > 0.0:
        return [warming, -m * warming / 3.5 / (1.0 + np.exp((355.0 - warm) / 3.5))]
    return [warming, -(1.0 - m) * warming / 3.5 / (1.0 + np.exp((warm - 330.0) / 3.5))]


def oscillator(t: float, x: FloatArray, u: float) -> list[float]:
    """Lengths in mm."""
    z, v = x
    return [v, 300.0 * u - 4.0 * v - (8882.6 + 6e5 * z**2) * z]


CASES: dict[
    str,
    tuple[Rates, dict[str, str], list[float], tuple[float, float, float], Callable[[FloatArray], FloatArray]],
]
CASES = {
    "cascaded_tanks": (tanks, {"u": "V", "y": "V"}, [5.0, 5.0], (4.0, 3.0, 1.5), lambda x: x[1]),
    "pendulum": (
        pendulum, {"torque": "mN*m", "reading": "deg"}, [0.0, 0.0], (0.02, 0.0, 300.0), lambda x: np.rad2deg(x[0]),
    ),
    "dc_motor": (
        motor, {"voltage": "V", "rpm": "rpm", "measured": "A"}, [0.0, 0.0], (0.01, 0.0, 3.0),
        lambda x: x[1] * 30.0 / np.pi,
    ),
    "heated_body": (body, {"power": "W", "temperature": "K"}, [293.15, 293.15], (5.0, 10.0, 10.0), lambda x: x[1]),
    "duffing_circuit": (
        circuit, {"source": "V", "reading": "mV"}, [0.0, 0.0], (1e-4, 0.0, 2.0), lambda x: x[1] / 1e-6 * 1e3,
    ),
    "voice_coil": (
        coil, {"voltage": "V", "x": "mm", "coil": "A"}, [0.0, 0.0, 0.0], (2e-4, 0.0, 3.0), lambda x: x[1],
    ),
    "piezo_stack": (
        stack, {"command": "V", "x": "um", "charge": "uC"}, [0.0] * 5, (1e-3, 40.0, 30.0), lambda x: x[3],
    ),
    "sma_wire": (
        wire, {"current": "A", "contraction": "mm", "resistance": "ohm"}, [298.0, 0.98], (0.02, 0.3, 0.3),
        lambda x: 5.0 * (1.0 - x[1]),
    ),
    "oscillator": (
        oscillator, {"drive": "V", "displacement": "um"}, [0.0, 0.0], (2e-3, 0.0, 5.0), lambda x: 1e3 * x[0],
    ),
}  # fmt: skip
ELSEWHERE = {"bouncing_ball", "thermostat", "vo2_mirror"}
"""Models whose cases stand in `test_equations_events.py` and `test_equations_several_outputs.py`."""
FACTORS = {"pendulum": 1e-3}
"""SI units of the input in the data, where that is not in the units of the rates here."""


def test_every_shipped_model_has_a_case_and_is_short() -> None:
    files = sorted(EXAMPLES.glob("*.toml"))
    assert {path.stem for path in files} == set(CASES) | ELSEWHERE
    for path in files:
        model, _, _ = path.read_text(encoding="utf-8").partition("[device]")
        assert len(model.splitlines()) < 40, path


@pytest.mark.parametrize("name", CASES)
def test_a_shipped_model_follows_scipy(name: str) -> None:
    rates, units, start, (period_s, mean, size), read = CASES[name]
    path = EXAMPLES / f"{name}.toml"
    simulation = equations_simulation(read_equations(path), units, str(path))
    (drive, output), n = list(units)[:2], 150
    u = mean + size * np.sin(2.0 * np.pi * np.arange(n) / 40.0) * np.cos(np.arange(n) / 31.0)
    run = simulation.predict(
        Stimulus(inputs={drive: u}, holds={drive: "zero"}, period_s=period_s),
        np.array([one.value for one in simulation.parameters]),
    )
    x = [np.array(start)]
    for k in range(n - 1):
        level = FACTORS.get(name, 1.0) * u[k]
        found = solve_ivp(
            lambda t, y, level=level: rates(t, y, level), (0.0, period_s), x[-1], method="DOP853",
            rtol=1e-10, atol=1e-10 * np.maximum(np.abs(x[-1]), 1e-6),
        )  # fmt: skip
        x.append(found.y[:, -1])
    expected = read(np.array(x).T)
    assert np.ptp(expected) > 0.0
    assert np.abs(run.outputs[output][0] - expected).max() < 2e-5 * np.ptp(expected)
