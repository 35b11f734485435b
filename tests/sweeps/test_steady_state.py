"""The steady state against SciPy, against harmonic balance, and against the package's own records in time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sweep_cases import CUBIC, DAMPING, GAIN, STIFFNESS, UP, response

from plant_sim.oscillator.model import oscillator_simulation, simulation_of_data
from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, ModelFile, ModelTable, Value
from rtctl.border.simulation import Stimulus

UNITS = {"drive": "V", "displacement": "um", "frequency": "Hz"}


def model(cubic: float = CUBIC, **mechanisms: dict[str, tuple[float, str]]) -> ModelFile:
    nominal = {
        "damping": Value(value=DAMPING, unit="1/s"),
        "stiffness": Value(value=STIFFNESS, unit="1/s^2"),
        "stiffness_cubic": Value(value=cubic, unit="1/(um^2*s^2)"),
        "drive_gain": Value(value=GAIN, unit="um/s^2/V"),
    }
    tables = tuple(
        MechanismTable(
            id=name.replace("__", "."),
            parameters={key: Value(value=value, unit=unit) for key, (value, unit) in values.items()},
        )
        for name, values in mechanisms.items()
    )
    return ModelFile(model=ModelTable(kind="oscillator", parameters=nominal, mechanisms=tables))


def swept(frequency_hz: np.ndarray, drive: float, **more: Any) -> Stimulus:
    return Stimulus(
        inputs={"drive": np.full(2 * len(frequency_hz), drive), "frequency": np.repeat(frequency_hz, 2)},
        holds={"drive": "linear", "frequency": "linear"}, period_s=0.5, peak={"displacement": 1.5}, **more,
    )  # fmt: skip


def simulated(made: ModelFile, frequency_hz: np.ndarray, drive: float, **more: Any) -> np.ndarray:
    simulation = simulation_of_data(made, UNITS, "model")
    values = np.array([one.value for one in simulation.parameters])
    found = simulation.predict(swept(frequency_hz, drive, **more), values).outputs["displacement"][0]
    return found[::2] + 1j * found[1::2]


def test_a_linear_response_is_the_transfer_function() -> None:
    s = 2j * np.pi * UP
    expected = 0.1 * GAIN / (s**2 + DAMPING * s + STIFFNESS)
    np.testing.assert_allclose(simulated(model(cubic=0.0), UP, 0.1), expected, rtol=2e-5)


def test_a_row_is_what_scipy_settles_on() -> None:
    frequency, drive = 101.0, 0.1

    def rates(t: float, y: np.ndarray) -> list[float]:
        u = drive * np.cos(2.0 * np.pi * frequency * t)
        return [y[1], GAIN * u - DAMPING * y[1] - (STIFFNESS + CUBIC * y[0] ** 2) * y[0]]

    settled = solve_ivp(rates, (0.0, 150 / frequency), [0.0, 0.0], "DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
    t = np.arange(64) / 64 / frequency
    z = solve_ivp(rates, (0.0, 1.0 / frequency), settled, "DOP853", t, rtol=1e-9, atol=1e-12).y[0]
    expected = 2.0 * np.mean(z * np.exp(-2j * np.pi * np.arange(64) / 64))
    assert simulated(model(), np.array([frequency]), drive)[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("frequency_hz", [UP, UP[::-1]], ids=["rising", "falling"])
def test_a_sweep_follows_its_branch_through_the_fold(frequency_hz: np.ndarray) -> None:
    drive = 0.4
    found, expected = simulated(model(), frequency_hz, drive), response(frequency_hz, drive)
    assert np.abs(np.diff(np.abs(found))).max() > 0.5  # it jumps
    jump = int(np.abs(np.diff(np.abs(found))).argmax())
    at = frequency_hz[jump]
    other = np.abs(simulated(model(), frequency_hz[::-1], drive))[::-1]
    assert np.abs(other - np.abs(found)).max() > 0.5, "both directions are on one branch"
    before = slice(0, jump - 1)
    np.testing.assert_allclose(np.abs(found[before] - expected[before]), 0.0, atol=2e-3)
    assert 100.0 < at < 106.0


def test_a_guide_chooses_the_branch_that_was_measured() -> None:
    drive = 0.4
    rising, falling = simulated(model(), UP, drive), simulated(model(), UP[::-1], drive)[::-1]
    guide = np.column_stack([falling.real, falling.imag]).reshape(-1)
    guided = simulated(model(), UP, drive, guide={"displacement": guide})
    assert np.abs(rising - falling).max() > 0.5
    np.testing.assert_allclose(guided, falling, atol=1e-6)


@pytest.mark.parametrize(
    "mechanism",
    [
        {"drive__delay": {"delay": (3e-4, "s")}},
        {"drive__lag": {"time_constant": (4e-4, "s")}},
        {"sensor__lag": {"time_constant": (4e-4, "s")}},
        {"drive__saturation": {"curvature": (200.0, "1/V^2")}},
        {"mode__second": {"gain": (3e4, "um/s^2/V"), "frequency": (130.0, "Hz"), "damping_ratio": (0.02, "dimensionless")}},  # noqa: E501
        {"friction__coulomb": {"level": (400.0, "um/s^2")}},
        {"damping__quadratic": {"coefficient": (0.01, "1/um")}},
        {"sensor__crosstalk": {"gain": (2.0, "um/V"), "rate": (3e-3, "um*s/V")}},
    ],
    ids=lambda one: next(iter(one)),
)  # fmt: skip
def test_a_mechanism_does_what_it_does_in_a_long_record(mechanism: dict[str, Any]) -> None:
    made, frequency, drive = model(**mechanism), 101.0, 0.1
    rate_hz, periods = 64 * frequency, 160
    simulation = oscillator_simulation(made, {"drive": "V", "displacement": "um"}, "model")
    t = np.arange(int(periods * 64)) / rate_hz
    record = Stimulus(
        inputs={"drive": drive * np.cos(2.0 * np.pi * frequency * t)}, holds={"drive": "band-limited"},
        period_s=1.0 / rate_hz,
    )  # fmt: skip
    values = np.array([one.value for one in simulation.parameters])
    z = simulation.predict(record, values).outputs["displacement"][0][-30 * 64 : -20 * 64]
    expected = 2.0 * np.mean(z * np.exp(-2j * np.pi * np.arange(len(z)) / 64))
    found = simulated(made, np.array([100.0, frequency]), drive)[1]
    without = simulated(model(), np.array([100.0, frequency]), drive)[1]
    assert abs(expected - without) > 0.01 * abs(expected)
    assert found == pytest.approx(expected, abs=1e-3 * abs(expected))


def test_a_mechanism_without_a_trace_in_a_steady_state_is_refused() -> None:
    made = model(sensor__offset={"offset": (0.1, "um")})
    with pytest.raises(InputError, match=r"sensor\.offset: a steady state does not show it"):
        simulation_of_data(made, UNITS, "model.toml")
