"""Simulated equations: against SciPy's integrators, against the built-in oscillator, at limits, stiff, diverging."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from equation_cases import OSCILLATOR, TANKS, simulation_of
from scipy.integrate import solve_ivp

from plant_sim.equations.compiled import kernels
from plant_sim.equations.integration.steps import Plan
from plant_sim.equations.plant import load_plant
from plant_sim.equations.simulation import EquationsSimulation
from plant_sim.oscillator.model import oscillator_simulation
from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import read_model_file
from rtctl.border.simulation import Stimulus

UNITS = {"drive": "V", "displacement": "mm"}


def own_values(simulation: EquationsSimulation) -> FloatArray:
    return np.array([one.value for one in simulation.parameters])


def held(samples: FloatArray, period_s: float, hold: str) -> Callable[[float, int], float]:
    """The input in interval k at time t."""

    def at(t: float, k: int) -> float:
        if hold == "zero":
            return float(samples[k])
        return float(samples[k] + (samples[k + 1] - samples[k]) * (t / period_s - k))

    return at


def by_scipy(
    rates: Callable[[float, FloatArray, float], list[float]], start: list[float], samples: FloatArray,
    period_s: float, hold: str = "zero", method: str = "DOP853",
) -> FloatArray:  # fmt: skip
    """States (samples, states), interval by interval, as the input has corners at the samples."""
    u, x = held(samples, period_s, hold), [np.array(start)]
    for k in range(len(samples) - 1):
        found = solve_ivp(
            lambda t, y, k=k: rates(t, y, u(t, k)), (k * period_s, (k + 1) * period_s), x[-1], method=method,
            rtol=1e-11, atol=1e-13,
        )  # fmt: skip
        x.append(found.y[:, -1])
    return np.array(x)


def off(found: FloatArray, expected: FloatArray) -> float:
    return float(np.abs(found - expected).max() / np.ptp(expected))


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_tanks_follow_scipy(tmp_path: Path, hold: str) -> None:
    simulation = simulation_of(tmp_path, TANKS, {"u": "V", "y": "V"})
    samples = 3.0 + 2.0 * np.sin(np.arange(80) / 4.0)
    run = simulation.predict(
        Stimulus(inputs={"u": samples}, holds={"u": hold}, period_s=4.0), own_values(simulation)
    )

    def rates(t: float, x: FloatArray, u: float) -> list[float]:
        one, two = np.sqrt(np.maximum(x, 0.0))
        return [-0.05 * one + 0.03 * u, 0.06 * one - 0.04 * two]

    x = by_scipy(rates, [3.0, 3.0], samples, 4.0, hold)
    assert off(run.outputs["y"][0], 0.8 * x[:, 1]) < 1e-6
    assert off(run.outputs["x1"][0], x[:, 0]) < 1e-6


@pytest.mark.parametrize("hold", ["zero", "linear", "band-limited"])
def test_the_oscillator_in_equations_is_the_built_in_one(tmp_path: Path, hold: str) -> None:
    simulation = simulation_of(tmp_path, OSCILLATOR, UNITS)
    path = tmp_path / "oscillator.toml"
    path.write_text(
        '[model]\nkind = "oscillator"\n[model.parameters]' + OSCILLATOR.split("[model.parameters]")[1]
    )
    built_in = oscillator_simulation(read_model_file(path, "oscillator"), UNITS, "oscillator")
    samples = np.random.default_rng(0).standard_normal(3000)
    stimulus = Stimulus(inputs={"drive": samples}, holds={"drive": hold}, period_s=1e-3)
    values = np.array([own_values(simulation), 1.1 * own_values(simulation)])
    found, expected = simulation.predict(stimulus, values), built_in.predict(stimulus, values)
    for own, other in zip(found.outputs["displacement"], expected.outputs["displacement"], strict=True):
        assert off(own, other) < 1e-6
    assert float(np.ptp(found.outputs["displacement"][0])) > 0.05


def test_functions_and_choices_in_a_rate_follow_scipy(tmp_path: Path) -> None:
    text = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "1" }
[model.states]
a = { unit = "1", rate = "w*(where(a > 0 and u < 0.8 or not (b < 0), sin(b), cos(b)) - tanh(a) + exp(-a^2)*u)" }
b = { unit = "1", rate = "w*(atan2(u, 1 + a^2) - sign(b)*abs(b)^1.5 + min(a, u, 0.3) - floor(u))", initial = 0.5 }
[model.outputs]
y = { unit = "1", value = "a + u" }
[model.parameters]
w = { value = 1.0, unit = "1/s" }
"""
    simulation = simulation_of(tmp_path, text, {"u": "1", "y": "1"})
    samples = np.sin(np.arange(60) / 3.0)
    period_s = 0.1
    run = simulation.predict(
        Stimulus(inputs={"u": samples}, holds={"u": "zero"}, period_s=period_s),
        own_values(simulation),
        refine=8,
    )

    def rates(t: float, x: FloatArray, u: float) -> list[float]:
        a, b = x
        first = np.sin(b) if (a > 0 and u < 0.8) or not b < 0 else np.cos(b)
        return [
            first - np.tanh(a) + np.exp(-(a**2)) * u,
            np.arctan2(u, 1 + a**2) - np.sign(b) * abs(b) ** 1.5 + min(a, u, 0.3) - np.floor(u),
        ]

    x = by_scipy(rates, [0.0, 0.5], samples, period_s)
    before = np.concatenate((samples[:1], samples[:-1]))  # a held input takes effect after the sample
    assert off(run.outputs["y"][0], x[:, 0] + before) < 1e-4


def test_a_state_stays_at_its_limit_while_its_rate_points_outward(tmp_path: Path) -> None:
    text = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x = { unit = "mm", rate = "g*u", low = -1.0, high = 2.0 }
[model.outputs]
y = { unit = "mm", value = "x" }
[model.parameters]
g = { value = 1.37, unit = "mm/(V*s)" }
"""
    simulation = simulation_of(tmp_path, text, {"u": "V", "y": "mm"})
    samples = np.repeat([1.0, -1.0, 1.0], 50)
    run = simulation.predict(
        Stimulus(inputs={"u": samples}, holds={"u": "zero"}, period_s=0.1), own_values(simulation)
    )
    expected = [0.0]
    for u in samples[:-1]:
        expected.append(float(np.clip(expected[-1] + 0.137 * u, -1.0, 2.0)))
    np.testing.assert_allclose(run.outputs["y"][0], expected, atol=1e-12)


STIFF = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
a = { unit = "V", rate = "(u - a)/slow" }
b = { unit = "V", rate = "(a^2/s - b)/fast" }
[model.outputs]
y = { unit = "V", value = "b" }
[model.parameters]
slow = { value = 1.0, unit = "s" }
fast = { value = 1e-6, unit = "s" }
s = { value = 1.0, unit = "V" }
"""


def test_a_stiff_model_is_integrated_implicitly_and_follows_radau(tmp_path: Path, monkeypatch) -> None:
    simulation = simulation_of(tmp_path, STIFF, {"u": "V", "y": "V"})
    samples = np.sin(np.arange(40) / 4.0)
    monkeypatch.setattr("plant_sim.equations.compiled.kernels._integrator", _refused)
    run = simulation.predict(
        Stimulus(inputs={"u": samples}, holds={"u": "linear"}, period_s=0.1), own_values(simulation)
    )

    def rates(t: float, x: FloatArray, u: float) -> list[float]:
        return [u - x[0], (x[0] ** 2 - x[1]) / 1e-6]

    x = by_scipy(rates, [0.0, 0.0], samples, 0.1, "linear", method="Radau")
    assert off(run.outputs["y"][0], x[:, 1]) < 1e-6
    assert off(run.outputs["a"][0], x[:, 0]) < 1e-6


def _refused(*arguments: object) -> None:
    raise AssertionError("explicit steps of a stiff model")


def test_implicit_steps_are_of_fourth_order(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, OSCILLATOR, UNITS)
    p = own_values(simulation)[:, None] * np.array([[one.factor] for one in simulation.system.parameters])
    nodes = np.random.default_rng(3).standard_normal((20, 1))
    errors = []
    runs = {}
    for substeps in (8, 16, 32, 256):
        per_step = np.repeat(nodes, substeps, axis=0)
        how = Plan(substeps, implicit=True)
        runs[substeps] = kernels.march(
            simulation.system, np.zeros((2, 1)), np.stack([per_step] * 3), 2e-3, how, p
        )
    errors = [np.abs(runs[n] - runs[256])[:, 0].max() for n in (8, 16, 32)]
    slopes = np.diff(np.log2(errors))
    assert (slopes < -3.5).all(), slopes


def test_a_model_too_fast_for_any_step_is_said(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, OSCILLATOR.replace("value = 8882.6", "value = 1e20"), UNITS)
    stimulus = Stimulus(inputs={"drive": np.ones(10)}, holds={"drive": "linear"}, period_s=1e-3)
    with pytest.raises(ValueError, match=r"steps between two samples .*check the units"):
        simulation.predict(stimulus, own_values(simulation))


def test_a_motion_without_bound_diverges_at_its_sample(tmp_path: Path) -> None:
    text = (
        OSCILLATOR.replace('rate = "v"', 'rate = "v + grow*z^3"')
        + 'grow = { value = 2.0, unit = "1/(mm^2*s)" }\n'
    )
    simulation = simulation_of(
        tmp_path, text.replace('unit = "mm", rate', 'unit = "mm", initial = 5.0, rate'), UNITS
    )
    stimulus = Stimulus(inputs={"drive": np.ones(100)}, holds={"drive": "zero"}, period_s=1e-2)
    values = own_values(simulation)
    run = simulation.predict(stimulus, np.array([values, values * np.where(np.arange(5) == 4, -1.0, 1.0)]))
    assert 0 < run.diverged_at[0] < 100
    assert run.diverged_at[1] == -1


def test_a_rate_without_value_at_the_start_is_said(tmp_path: Path) -> None:
    text = TANKS.replace("k4*u", "k4*u0*log(u/u0)") + 'u0 = { value = 1.0, unit = "V" }\n'
    simulation = simulation_of(tmp_path, text, {"u": "V", "y": "V"})
    stimulus = Stimulus(inputs={"u": np.full(10, -1.0)}, holds={"u": "zero"}, period_s=1.0)
    with pytest.raises(ValueError, match="the rate of the state x1 is nan at the start of the record"):
        simulation.predict(stimulus, own_values(simulation))


def test_a_state_starts_where_the_record_says(tmp_path: Path) -> None:
    simulation = simulation_of(tmp_path, TANKS, {"u": "V", "y": "V"})
    stimulus = Stimulus(
        inputs={"u": np.ones(5)},
        holds={"u": "zero"},
        period_s=1.0,
        initial={"x2": 0.07, "y": 1.0},
        read=frozenset({"y"}),
    )
    values = own_values(simulation)
    np.testing.assert_allclose(simulation.starting(stimulus, values), [3.0, 7.0])
    assert simulation.predict(stimulus, values).outputs["y"][0, 0] == pytest.approx(0.8 * 7.0)
    assert simulation.predict(stimulus, values, np.array([[3.0, 5.0]])).outputs["y"][0, 0] == pytest.approx(
        4.0
    )


def test_a_kernel_is_loaded_from_disk_by_another_process(tmp_path: Path) -> None:
    system = simulation_of(tmp_path, TANKS, {"u": "V", "y": "V"}).system
    sources = kernels.rates_source(system), kernels.rk4_source(system)
    for _ in range(2):
        kernels._rk4.cache_clear()  # as in a new process
        kernel = kernels._rk4(*sources)
        kernel(np.ones((2, 1)), np.ones((3, 2, 1)), 0.1, 1, 0.0, np.ones((5, 1)), np.empty((3, 2, 1)))
    if hasattr(kernel, "stats"):
        assert sum(kernel.stats.cache_hits.values()) == 1
        assert not kernel.stats.cache_misses


def test_a_plan_belongs_to_its_model(tmp_path: Path) -> None:
    """Of two models with one parameter on one record, the second is a hundred times as fast."""
    stimulus = Stimulus(inputs={"u": np.ones(50)}, holds={"u": "zero"}, period_s=0.1)
    text = """
[model]
kind = "equations"
[model.inputs]
u = {{ unit = "1" }}
[model.states]
x = {{ unit = "1", rate = "{0}*w*y" }}
y = {{ unit = "1", rate = "-{0}*w*x", initial = 1.0 }}
[model.outputs]
z = {{ unit = "1", value = "x" }}
[model.parameters]
w = {{ value = 1.0, unit = "1/s" }}
"""
    for times in (1, 100):
        simulation = simulation_of(tmp_path, text.format(times), {"u": "1", "z": "1"})
        found = simulation.predict(stimulus, own_values(simulation)).outputs["z"][0]
        del simulation  # its place in memory may be the next one's
        assert off(found, np.sin(times * 0.1 * np.arange(50))) < 1e-5


def test_a_device_compiles_once_and_asks_for_no_source_again(monkeypatch) -> None:
    plant = load_plant(Path(__file__).parents[2] / "scenarios/models/equations/dc_motor.toml")
    levels = [0.1] * len(plant.low)
    first = plant.step(levels, 1e-3)
    monkeypatch.setattr("plant_sim.equations.compiled.kernels.rk4_source", _refused)
    assert np.isfinite(plant.step(levels, 1e-3)[0]).all()
    assert np.isfinite(first[0]).all()
