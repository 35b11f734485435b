"""A unit computes what `rtctl simulate` computes, for each kind of plant, mechanism and integrator, within rounding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import MECHANISMS, free_runs, oscillator, oscillator_data

import rtctl
from plant_sim.equations.reading import read_equations
from rtctl import Record

pytest.importorskip("fmpy")
MODELS = Path("scenarios/models/equations")
ROUNDING = 1e-11
"""In parts of the range: rounding of 1e4 steps, each of 1e-16, grows by a factor of ten where motions part."""
STIFF = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
a = { unit = "V", rate = "(u - a)/slow" }
b = { unit = "V", rate = "(a^2/s - b)/fast" }
[model.outputs]
y = { unit = "V", value = "b + 0.1*u" }
[model.parameters]
slow = { value = 1.0, unit = "s" }
fast = { value = 1e-6, unit = "s" }
s = { value = 1.0, unit = "V" }
"""
PERIODS_S = {"cascaded_tanks": 4.0, "heated_body": 1.0, "thermostat": 60.0}
LEVELS = {"thermostat": (275.0, 290.0)}
"""Levels of the inputs of models without a device, where 0 to 1 is absurd."""


def equations_data(model: Path, folder: Path, hold: str, period_s: float) -> rtctl.Dataset:
    """Return a record of random levels within the limits of the model's device."""
    content = read_equations(model)
    rng = np.random.default_rng(1)
    limits = content.device.get("inputs", {})
    signals = {}
    for name in content.model.inputs:
        told = [limits.get(name, {}).get(word) for word in ("low", "high")]
        low, high = LEVELS.get(model.stem, (0.0, 1.0)) if None in told else (_number(one) for one in told)
        signals[name] = np.repeat(rng.uniform(low, high, 20), 10)
    units = {name: one.unit for name, one in (content.model.inputs | content.model.outputs).items()}
    signals |= {name: np.zeros(200) for name in content.model.outputs}
    record = Record(name="a", period_s=period_s, use="test", signals=signals)
    holds = dict.fromkeys(content.model.inputs, hold)
    return rtctl.write_dataset(
        folder / "data", [record], name="x", plant="equations", units=units, holds=holds
    )


def _number(value: float | str) -> float:
    return float(value.split()[0]) if isinstance(value, str) else float(value)


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=() if one in ("bouncing_ball", "voice_coil") else pytest.mark.slow)
             for one in sorted(path.stem for path in MODELS.glob("*.toml"))],
)  # fmt: skip
def test_equations_as_a_unit_are_their_simulation(name: str, hold: str, tmp_path: Path) -> None:
    data = equations_data(MODELS / f"{name}.toml", tmp_path, hold, PERIODS_S.get(name, 2e-3))
    errors = free_runs(MODELS / f"{name}.toml", data, tmp_path, "3.0" if hold == "zero" else "2.0")
    assert max(errors.values()) < ROUNDING, errors


def test_a_stiff_model_as_a_unit_is_its_simulation(tmp_path: Path) -> None:
    model = tmp_path / "stiff.toml"
    model.write_text(STIFF)
    data = equations_data(model, tmp_path, "zero", 0.1)
    unit = rtctl.export_fmu(model, tmp_path / "stiff.fmu", dataset=data)
    assert "implicit" in unit.method
    assert max(free_runs(model, data, tmp_path).values()) < ROUNDING


def test_mechanisms_that_are_terms_of_equations_are_in_the_unit(tmp_path: Path) -> None:
    model = tmp_path / "model.toml"
    text = (MODELS / "oscillator.toml").read_text()
    model.write_text(
        text + '\n[[model.mechanisms]]\nid = "state.v.quadratic"\n'
        'parameters = { even = { value = 2.0, unit = "1/mm" } }\n'
    )
    plain = equations_data(MODELS / "oscillator.toml", tmp_path, "zero", 2e-3)
    with_it, without = (
        rtctl.simulate(one, plain).records["a"].simulated for one in (model, MODELS / "oscillator.toml")
    )
    assert np.ptp(with_it["displacement"] - without["displacement"]) > 1e-3 * np.ptp(without["displacement"])
    assert max(free_runs(model, plain, tmp_path).values()) < ROUNDING


def _quick(case: str) -> object:
    quick = case in {"friction.stribeck", "stiffness.clearance", "sensor.lag", "drive.lag"}
    return pytest.param(case, marks=() if quick else pytest.mark.slow)


@pytest.mark.parametrize("case", [_quick(one) for one in MECHANISMS])
def test_each_mechanism_of_an_oscillator_in_a_unit_is_as_in_its_simulation(case: str, tmp_path: Path) -> None:
    data = oscillator_data(tmp_path, "linear")
    errors = free_runs(oscillator(tmp_path, case), data, tmp_path)
    assert errors["displacement"] < ROUNDING, errors


@pytest.mark.parametrize("cubic", [0.0, 600.0])
def test_a_splitting_in_a_unit_is_that_of_the_simulation(cubic: float, tmp_path: Path) -> None:
    data = oscillator_data(tmp_path)
    model = oscillator(tmp_path, cubic=cubic)
    assert "splitting" in rtctl.export_fmu(model, tmp_path / "a.fmu", dataset=data).method
    assert free_runs(model, data, tmp_path, "2.0")["displacement"] < ROUNDING


def test_mechanisms_act_together_in_the_order_of_the_simulation(tmp_path: Path) -> None:
    together = (
        "drive.lag",
        "drive.offset",
        "friction.coulomb",
        "hysteresis.bouc_wen",
        "sensor.highpass",
        "sensor.lag",
    )
    data = oscillator_data(tmp_path, "linear")
    assert free_runs(oscillator(tmp_path, *together), data, tmp_path)["displacement"] < ROUNDING
