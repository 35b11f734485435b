"""Velocity and acceleration as outputs, and what the instruments that read them add; against scipy's equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.simulation import OscillatorSimulation
from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus

PERIOD_S, SAMPLES = 4e-3, 400
DAMPING, STIFFNESS, GAIN = 6.0, 4.0e3, 300.0
CUBIC = {"id": "stiffness.cubic", "parameters": {"coefficient": {"value": 900.0, "unit": "1/(mm^2*s^2)"}}}
UNITS = {
    "displacement": {"drive": "V", "displacement": "mm"},
    "velocity": {"drive": "V", "velocity": "mm/s"},
    "acceleration": {"drive": "V", "acceleration": "mm/s^2"},
}


def drive() -> FloatArray:
    time_s = PERIOD_S * np.arange(SAMPLES)
    return sum(np.sin(2.0 * np.pi * f * time_s + f) for f in (3.0, 9.5, 14.0))


def bound(response: str, *mechanisms: dict[str, object]) -> OscillatorSimulation:
    parameters = {
        "damping": {"value": DAMPING, "unit": "1/s"},
        "stiffness": {"value": STIFFNESS, "unit": "1/s^2"},
        "drive_gain": {"value": GAIN, "unit": "mm/(s^2*V)"},
    }
    model = ModelFile.model_validate(
        {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": mechanisms}}
    )
    return oscillator_simulation(model, UNITS[response], "test")


def predicted(simulation: OscillatorSimulation, hold: str, output: str) -> FloatArray:
    values = np.array([one.value for one in simulation.parameters])
    record = Stimulus(inputs={"drive": drive()}, holds={"drive": hold}, period_s=PERIOD_S)
    return simulation.predict(record, values).outputs[output][0]


def exact(hold: str) -> dict[str, FloatArray]:
    """Each sample period by itself, since a held drive jumps at its ends; the acceleration before the jump."""
    u, state, courses = drive(), np.zeros(2), [[0.0, 0.0, GAIN * drive()[0]]]

    def acceleration(z: float, v: float, force: float) -> float:
        return GAIN * force - DAMPING * v - STIFFNESS * z - 900.0 * z**3

    for k in range(SAMPLES - 1):
        ends = (u[k], u[k] if hold == "zero" else u[k + 1])

        def rates(t: float, y: FloatArray, ends: tuple[float, float] = ends) -> list[float]:
            return [y[1], acceleration(y[0], y[1], ends[0] + (ends[1] - ends[0]) * t / PERIOD_S)]

        state = solve_ivp(rates, (0.0, PERIOD_S), state, rtol=1e-10, atol=1e-12).y[:, -1]
        courses.append([*state, acceleration(*state, ends[1])])
    return dict(zip(("displacement", "velocity", "acceleration"), np.array(courses).T, strict=True))


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("response", ["velocity", "acceleration"])
def test_a_response_is_that_of_the_equation(hold: str, response: str) -> None:
    truth = exact(hold)[response]
    found = predicted(bound(response, CUBIC), hold, response)
    assert np.abs(found - truth).max() < 2e-5 * np.abs(truth).max()


def test_an_offset_of_the_instrument_is_in_the_response_and_in_its_unit() -> None:
    offset = {"id": "sensor.offset", "parameters": {"offset": {"value": 0.5, "unit": "m/s^2"}}}
    added = predicted(bound("acceleration", offset), "linear", "acceleration") - predicted(
        bound("acceleration"), "linear", "acceleration"
    )
    assert added == pytest.approx(500.0)  # mm/s^2


@pytest.mark.parametrize("response", ["velocity", "acceleration"])
def test_an_instrument_that_lags_does_so_in_the_response(response: str) -> None:
    """y with tau y' = r - y, by scipy, of the response r without the lag."""
    tau = 0.01
    lag = {"id": "sensor.lag", "parameters": {"time_constant": {"value": tau, "unit": "s"}}}
    r = predicted(bound(response), "linear", response)
    time_s = PERIOD_S * np.arange(SAMPLES)
    reading = solve_ivp(
        lambda t, y: (np.interp(t, time_s, r) - y) / tau, (0.0, time_s[-1]), r[:1], t_eval=time_s,
        max_step=PERIOD_S / 4.0, rtol=1e-8,
    ).y[0]  # fmt: skip
    found = predicted(bound(response, lag), "linear", response)
    assert np.abs(found - reading).max() < 0.01 * np.abs(reading).max()


@pytest.mark.parametrize("response", ["velocity", "acceleration"])
def test_a_second_mode_is_seen_in_the_response(response: str) -> None:
    """What it adds to the velocity or acceleration is the derivative of what it adds to the displacement."""
    parameters = {
        "gain": {"value": 80.0, "unit": "mm/(s^2*V)"},
        "frequency": {"value": 12.0, "unit": "Hz"},
        "damping_ratio": {"value": 0.05, "unit": "dimensionless"},
    }
    mode = {"id": "mode.second", "parameters": parameters}

    def added(of: str) -> FloatArray:
        return predicted(bound(of, mode), "linear", of) - predicted(bound(of), "linear", of)

    slope = added("displacement")
    for _ in range({"velocity": 1, "acceleration": 2}[response]):
        slope = np.gradient(slope, PERIOD_S)
    inner = slice(4, -4)
    assert np.abs(added(response) - slope)[inner].max() < 0.06 * np.abs(slope).max()


def place(tau_s: float) -> dict[str, object]:
    values = {"above": (4e4, "1/s^2"), "place": (0.02, "mm"), "retardation_time": (tau_s, "s")}
    return {
        "id": "stop.one_sided",
        "parameters": {k: {"value": v, "unit": u} for k, (v, u) in values.items()},
    }


@pytest.mark.parametrize("tau_s", [0.0, 2e-3], ids=["elastic", "with a damper"])
def test_the_acceleration_behind_a_stop_is_that_of_the_equation_where_its_force_begins(tau_s: float) -> None:
    """Differences of the velocity across the place of the stop would be off by percents."""
    found = {name: predicted(bound("acceleration", place(tau_s)), "linear", name) for name in UNITS}
    z, v = found["displacement"], found["velocity"]
    beyond = z > 0.02
    force = 4e4 * (z - 0.02 + tau_s * v) * beyond
    truth = GAIN * drive() - DAMPING * v - STIFFNESS * z - force
    assert beyond.sum() > SAMPLES // 20
    assert np.abs(found["acceleration"] - truth).max() < 1e-9 * np.abs(truth).max()


def test_dry_friction_is_in_the_acceleration_while_it_slides_and_while_it_sticks() -> None:
    level = 250.0
    friction = {"id": "friction.coulomb", "parameters": {"level": {"value": level, "unit": "mm/s^2"}}}
    found = {name: predicted(bound("acceleration", friction), "linear", name) for name in UNITS}
    z, v = found["displacement"], found["velocity"]
    sticks = v == 0.0
    other = GAIN * drive() - DAMPING * v - STIFFNESS * z
    truth = other - np.where(sticks, np.clip(other, -level, level), level * np.sign(v))
    assert min(sticks.sum(), (~sticks).sum()) > 20
    assert np.abs(found["acceleration"] - truth).max() < 1e-9 * np.abs(truth).max()


def test_the_acceleration_of_a_hysteretic_force_is_the_rate_of_the_velocity() -> None:
    hysteresis = {
        "id": "hysteresis.bouc_wen",
        "parameters": {
            "level": {"value": 200.0, "unit": "mm/s^2"},
            "displacement": {"value": 0.02, "unit": "mm"},
        },
    }
    found = {name: predicted(bound("acceleration", hysteresis), "linear", name) for name in UNITS}
    v, a = found["velocity"], found["acceleration"]
    gained = PERIOD_S * np.cumsum(0.5 * (a[1:] + a[:-1]))
    assert np.abs(v[1:] - v[0] - gained).max() < 0.03 * np.abs(v).max()
    assert (
        np.abs(a - predicted(bound("acceleration"), "linear", "acceleration")).max() > 0.2 * np.abs(a).max()
    )


@pytest.mark.parametrize("hold", ["linear", "band-limited"])
def test_the_acceleration_is_just_before_the_jump_also_where_the_manifest_does_not_know_of_it(
    hold: str,
) -> None:
    held = {"id": "input.hold", "parameters": {"toward_zero": {"value": 1.0, "unit": "dimensionless"}}}
    truth = exact("zero")["acceleration"]
    found = predicted(bound("acceleration", CUBIC, held), hold, "acceleration")
    assert np.abs(found - truth).max() < 2e-5 * np.abs(truth).max()
