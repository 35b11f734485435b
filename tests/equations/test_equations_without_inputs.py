"""Devices that nothing drives: oscillators that jump, their starts, and what is wrong with their equations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import odeint, solve_ivp

import rtctl
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from rtctl.border.simulation import Stimulus
from rtctl.cli import main

VAN_DER_POL = """
[model]
kind = "equations"
[model.states]
z = {{ unit = "1", rate = "v", initial = 2.0 }}
v = {{ unit = "1/s", rate = "mu*(1 - z^2)*v - w*z" }}
[model.outputs]
z = {{ unit = "1", value = "z" }}
[model.parameters]
mu = {{ value = {mu}, unit = "1/s" }}
w = {{ value = {w}, unit = "1/s^2" }}
"""
NEURON = """
[model]
kind = "equations"
[model.inputs]
i = { unit = "1" }
[model.states]
v = { unit = "1", rate = "(v - v^3/3 - w + i)/fast", initial = -1.2 }
w = { unit = "1", rate = "(v + 0.7 - 0.8*w)/slow", initial = -0.6 }
[model.outputs]
v = { unit = "1", value = "v" }
[model.parameters]
fast = { value = 1.0, unit = "ms" }
slow = { value = 1.0, unit = "s" }
"""


def solved(mu: float, times: np.ndarray, z: float = 2.0, extra: float = 0.0) -> np.ndarray:
    """SciPy's LSODA on the same equations, with a constant force more."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], mu * (1.0 - y[0] ** 2) * y[1] - y[0] + extra]

    return odeint(rates, [z, 0.0], times, tfirst=True, rtol=1e-12, atol=1e-14, mxstep=1_000_000)[:, 0]


def simulated(
    text: str, folder: Path, stimulus: Stimulus, output: str, values: np.ndarray | None = None
) -> np.ndarray:
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    simulation = equations_simulation(
        read_equations(path), {output: "1", **dict.fromkeys(stimulus.inputs, "1")}, "test"
    )
    own = np.array([one.value for one in simulation.parameters])
    return simulation.predict(stimulus, own if values is None else values).outputs[output]


def test_each_lane_of_a_relaxation_oscillator_jumps_at_its_own_time(tmp_path: Path) -> None:
    """Rows 1 s apart, jumps of some milliseconds, which move by many rows from lane to lane: no row is off by 2e-6."""
    times = np.arange(2001.0)
    stimulus = Stimulus(inputs={}, holds={}, period_s=1.0, count=len(times))
    lanes = np.array([[1000.0, 1.0], [900.0, 1.0]])
    found = simulated(VAN_DER_POL.format(mu=1000.0, w=1.0), tmp_path, stimulus, "z", lanes)
    for mu, course in zip((1000.0, 900.0), found, strict=True):
        assert np.abs(course - solved(mu, times)).max() < 4e-6


def test_jumps_that_a_held_input_sets_off_are_followed(tmp_path: Path) -> None:
    """A neuron (FitzHugh and Nagumo) that spikes within milliseconds where a held current is on, rows 50 ms apart."""
    current = np.repeat([0.0, 0.8, 0.0, 0.5], 50)
    stimulus = Stimulus(inputs={"i": current}, holds={"i": "zero"}, period_s=0.05)
    found = simulated(NEURON, tmp_path, stimulus, "v")[0]
    state, exact = [-1.2, -0.6], [-1.2]
    for level in current[:-1]:
        run = solve_ivp(
            lambda t, y, level=level: [1e3 * (y[0] - y[0] ** 3 / 3.0 - y[1] + level), y[0] + 0.7 - 0.8 * y[1]],
            (0.0, 0.05), state, "Radau", rtol=1e-9, atol=1e-11,
        )  # fmt: skip
        state = run.y[:, -1].tolist()
        exact.append(state[0])
    assert np.ptp(exact) > 3.0, "it spikes"
    assert np.abs(found - exact).max() < 1e-5 * np.ptp(exact)


@pytest.fixture
def measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Path:
    """Three records of a device, noise of 0.5 %, the last one from the other side; a model that is 8 % off."""
    monkeypatch.chdir(tmp_path)
    random, times = np.random.default_rng(3), np.arange(0.0, 30.0, 0.06)
    for k, z in enumerate((2.0, 0.4, -1.8)):
        read = solved(3.0, times, z, getattr(request, "param", 0.0)) + 0.01 * random.standard_normal(
            len(times)
        )
        np.savetxt(f"r{k}.csv", np.c_[times, read], delimiter=",", header="t [s],z [-]", comments="")
    Path("start.toml").write_text(VAN_DER_POL.format(mu=2.76, w=1.08), encoding="utf-8")
    return tmp_path


def test_a_test_record_that_starts_elsewhere_is_followed_from_there(
    measured: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "r0.csv", "r1.csv", "r2.csv", "--model", "start.toml", "--no-plot"]) == 0
    assert (
        main(["identify", "dataset.toml", "--model", "start.toml", "--out", "model.toml", "--no-plot"]) == 0
    )
    said = capsys.readouterr().out
    assert "test record r2: from the model's start its free run loses it" in said
    fit = rtctl.identify("dataset.toml", model="start.toml")
    assert fit.to_dict()["rms_error_test"]["r2"]["z"]["value"] < 0.012
    found = {name: one.value for name, one in fit.parameters.items()}
    assert found["mu"] == pytest.approx(3.0, rel=0.01)
    assert found["w"] == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    ("measured", "verdict", "causes"),
    [(0.0, "adequate", []), (0.3, "explained", ["state.v.input"])],
    indirect=["measured"],
)
def test_a_device_that_nothing_drives_is_diagnosed(measured: Path, verdict: str, causes: list[str]) -> None:
    made = rtctl.init(["r0.csv", "r1.csv", "r2.csv"], model="start.toml", plot=False)
    fit = rtctl.identify(made.path, model="start.toml")
    fit.save("model.toml")
    answer = rtctl.diagnose(made.path, model="model.toml")
    assert answer.verdict == verdict
    assert [one.id for one in answer.causes] == causes
    answer.save("out")
    assert (measured / "out" / "report.html").exists()
