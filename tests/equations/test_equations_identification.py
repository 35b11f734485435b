"""Identified equations: parameters and starts come back from noisy data, within bounds, with honest errors."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from equation_cases import TANKS, written

import rtctl
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.measured.dataset import Record

EXAMPLES = Path(__file__).resolve().parents[2] / "scenarios" / "models" / "equations"
TANK_DATA = Path(__file__).parents[3] / "shared" / "data" / "tanks"


# 7 parameters because each is one choice of a case
def dataset_of(folder, model, units, inputs, period_s, *, noise, initial=None, seed=0):
    """Write records of `model` driven by `inputs` [(use, {name: samples})] with white noise (a share of the signal)."""
    simulation = equations_simulation(read_equations(model), units, str(model))
    random, records = np.random.default_rng(seed), []
    values = np.array([one.value for one in simulation.parameters])
    names = [one.name for one in simulation.system.inputs]
    holds = dict.fromkeys(names, "linear")
    for k, (use, driven) in enumerate(inputs):
        stimulus = Stimulus(inputs=driven, holds=holds, period_s=period_s)
        run = simulation.predict(stimulus, values, None if initial is None else np.array([initial]))
        signals = dict(driven)
        for name in units:
            if name not in names:
                clean = run.outputs[name][0]
                signals[name] = clean + noise * np.std(clean) * random.standard_normal(len(clean))
        records.append(Record(name=f"r{k}", period_s=period_s, use=use, signals=signals))
    return rtctl.write_dataset(folder, records, name="made", plant="equations", units=units, holds=holds)


def wavy(n: int, size: float, mean: float = 0.0, seed: int = 0, smooth: int = 6):
    steps = np.random.default_rng(seed).uniform(-1.0, 1.0, n // smooth + 2)
    return mean + size * np.interp(np.arange(n) / smooth, np.arange(len(steps)), steps)


def changed(text: str, factors: dict[str, float]) -> str:
    """The model's text with values of parameters multiplied."""
    lines = []
    for line in text.splitlines():
        name = line.split("=")[0].strip()
        if name in factors and "value" in line:
            before = line.split("value")[1].split("=")[1].split(",")[0].strip()
            line = line.replace(before, repr(float(before) * factors[name]), 1)
        lines.append(line)
    return "\n".join(lines) + "\n"


CASES = {
    "pendulum": (
        {"torque": "N*m", "reading": "deg"}, "torque", 0.25, 0.0, 0.02,
        {"inertia": 1.2, "gravity": 0.9, "viscous": 2.0, "dry": 0.5},
    ),
    "dc_motor": (
        {"voltage": "V", "rpm": "rpm", "measured": "mA"}, "voltage", 6.0, 0.0, 0.005,
        {"resistance": 1.3, "k": 0.8, "inertia": 1.5, "sliding": 1.5, "viscous": 0.5, "excess": 0.6},
    ),
    "heated_body": (
        {"power": "W", "temperature": "K"}, "power", 10.0, 12.0, 10.0,
        {"exchange": 1.3, "capacity_inside": 0.7, "capacity_outside": 1.2, "convection": 1.3},
    ),
    "duffing_circuit": (
        {"source": "V", "reading": "V"}, "source", 4.0, 0.0, 1e-4,
        {"resistance": 1.4, "inductance": 0.9, "saturation": 0.6},
    ),
    "oscillator": (
        {"drive": "V", "displacement": "mm"}, "drive", 5.0, 0.0, 4e-3,
        {"damping": 1.5, "stiffness": 0.9, "stiffness_cubic": 0.7, "drive_gain": 1.3},
    ),
}  # fmt: skip
FIXED = {
    "heated_body": ("radiation",),
    "duffing_circuit": ("capacitance",),
    "dc_motor": ("film", "inductance"),
}
"""Parameters that the test keeps: what these data hardly show."""


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back_within_their_errors(tmp_path: Path, name: str) -> None:
    units, drive, size, mean, period_s, factors = CASES[name]
    text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
    for kept in FIXED.get(name, ()):
        text = re.sub(rf"^({kept} .*?) \}}$", r"\1, fixed = true }", text, flags=re.MULTILINE)
    truth = written(tmp_path, text, "truth.toml")
    inputs = [(use, {drive: wavy(600, size, mean, seed)}) for seed, use in enumerate(("fit", "test"))]
    data = dataset_of(tmp_path / "data", truth, units, inputs, period_s, noise=0.01)
    fit = rtctl.identify(data, model=written(tmp_path, changed(text, factors), "start.toml"))
    assert fit.trusted, fit.warnings
    true = rtctl.read_model(truth).parameters
    off = {
        parameter: abs(one.value - true[parameter].value) / one.standard_error
        for parameter, one in fit.parameters.items()
        if one.standard_error is not None and not one.fixed
    }
    assert set(factors) <= set(off)
    assert max(off.values()) < 4.5, off
    for output, rms in fit.to_dict()["rms_error_test"]["r1"].items():
        signal = np.std(data.records[1].signals[output])
        assert 0.008 < rms["value"] / signal < 0.02


def test_unknown_starts_are_fitted_and_written(tmp_path: Path) -> None:
    model = written(tmp_path, TANKS.replace('unit = "V/cm" }', 'unit = "V/cm", fixed = true }'))
    inputs = [(use, {"u": wavy(200, 2.0, 3.0, seed)}) for seed, use in enumerate(("fit", "test"))]
    data = dataset_of(
        tmp_path / "data", model, {"u": "V", "y": "V"}, inputs, 4.0, noise=0.003, initial=[6.0, 2.0]
    )
    fit = rtctl.identify(data, model=model)
    states = fit.model.content.model.states
    assert states["x1"].initial == pytest.approx(6.0, abs=0.3)
    assert states["x2"].initial == pytest.approx(2.0, abs=0.1)
    compared = rtctl.simulate(fit.model, data)
    assert max(one.nrmse for one in compared.scores) < 0.01
    assert fit.parameters["c"].fixed


def test_a_start_beyond_the_limit_of_its_state_is_written_at_the_limit(tmp_path: Path) -> None:
    """Tanks that begin empty: the noise puts the fitted start below 0, and diagnose refused such a file."""
    model = written(tmp_path, TANKS.replace('unit = "V/cm" }', 'unit = "V/cm", fixed = true }'))
    inputs = [(use, {"u": wavy(150, 2.0, 3.0, seed)}) for seed, use in enumerate(("fit", "test"))]
    for seed in range(4):
        folder = tmp_path / f"data{seed}"
        data = dataset_of(
            folder, model, {"u": "V", "y": "V"}, inputs, 4.0, noise=0.02, initial=[0.0, 0.0], seed=seed
        )
        fit = rtctl.identify(data, model=model)
        assert all(state.initial >= 0.0 for state in fit.model.content.model.states.values())
        fit.model.save(folder / "fitted.toml")
        rtctl.simulate(folder / "fitted.toml", data)


def test_a_start_that_is_known_stays(tmp_path: Path) -> None:
    text = TANKS.replace("initial = 3.0, low", "initial = 3.0, fixed = true, low").replace(
        'unit = "V/cm" }', 'unit = "V/cm", fixed = true }'
    )
    model = written(tmp_path, text)
    inputs = [("fit", {"u": wavy(200, 2.0, 3.0)})]
    data = dataset_of(tmp_path / "data", model, {"u": "V", "y": "V"}, inputs, 4.0, noise=0.003)
    fit = rtctl.identify(data, model=model)
    assert [one.initial for one in fit.model.content.model.states.values()] == [3.0, 3.0]
    assert fit.result.fit.initial.shape == (1, 0)


def test_parameters_that_the_outputs_cannot_determine_are_named(tmp_path: Path) -> None:
    """Without a sensor's sensitivity the upper tank has a level in no unit at all."""
    text = TANKS + 'idle = { value = 2.0, unit = "1/s" }\n'
    model = written(tmp_path, text)
    inputs = [("fit", {"u": wavy(200, 2.0, 3.0)})]
    data = dataset_of(tmp_path / "data", model, {"u": "V", "y": "V"}, inputs, 4.0, noise=0.01)
    fit = rtctl.identify(data, model=model)
    undetermined = fit.result.fit.determinability.undetermined
    assert "idle" in undetermined
    held, given = set(undetermined) - {"idle"}, rtctl.read_model(model).parameters
    assert len(held) == 2, "the two levels have scales of their own"
    assert [fit.parameters[name].value for name in held] == [given[name].value for name in held]
    (said,) = [one for one in fit.warnings if "no other input would" in one]
    assert all(f"{name} stays at {given[name].value:g}" in said for name in held)
    assert all(name in said for name in ("k1", "k2", "k4"))
    assert "these data say nothing of idle" in "\n".join(fit.warnings)
    assert fit.parameters["idle"].standard_error is None


def test_a_device_that_nothing_drives_is_identified_from_its_ring_down(tmp_path: Path) -> None:
    text = """
[model]
kind = "equations"
[model.states]
angle = { unit = "rad", rate = "speed", initial = 1.5 }
speed = { unit = "rad/s", rate = "-gravity*sin(angle) - damping*speed" }
[model.outputs]
reading = { unit = "deg", value = "angle" }
[model.parameters]
gravity = { value = 30.0, unit = "1/s^2", low = 0 }
damping = { value = 0.4, unit = "1/s", low = 0 }
"""
    simulation = equations_simulation(read_equations(written(tmp_path, text)), {"reading": "deg"}, "model")
    run = simulation.predict(Stimulus(inputs={}, holds={}, period_s=0.02, count=400), np.array([30.0, 0.4]))
    reading = run.outputs["reading"][0] + 0.2 * np.random.default_rng(0).standard_normal(400)
    record = Record(name="ring", period_s=0.02, signals={"reading": reading})
    data = rtctl.write_dataset(
        tmp_path / "data", [record], name="ring-down", plant="equations", units={"reading": "deg"}
    )
    start = written(tmp_path, text.replace("1.5", "1.2").replace("30.0", "27.0").replace("0.4", "0.2"))
    fit = rtctl.identify(data, model=start)
    assert fit.parameters["gravity"].value == pytest.approx(30.0, rel=2e-3)
    assert fit.parameters["damping"].value == pytest.approx(0.4, rel=2e-2)
    assert fit.model.content.model.states["angle"].initial == pytest.approx(1.5, abs=0.01)
    assert rtctl.simulate(fit.model, data).scores[0].rms_error == pytest.approx(0.2, rel=0.15)


def test_bounds_hold_and_are_kept(tmp_path: Path) -> None:
    truth = written(tmp_path, TANKS, "truth.toml")
    inputs = [("fit", {"u": wavy(200, 2.0, 3.0)})]
    data = dataset_of(tmp_path / "data", truth, {"u": "V", "y": "V"}, inputs, 4.0, noise=0.003)
    text = TANKS.replace("value = 0.04,", "value = 0.05, low = 0.045, high = 0.06,").replace(
        'unit = "V/cm" }', 'unit = "V/cm", fixed = true }'
    )
    fit = rtctl.identify(data, model=written(tmp_path, text))
    k3 = fit.parameters["k3"]
    assert (k3.low, k3.high) == (0.045, 0.06)
    assert 0.045 <= k3.value <= 0.06
    assert "k3 ended on its bound" in "\n".join(fit.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.2, 0.5, 2.5])
def test_a_resonance_is_found_from_far_off(factor: float, tmp_path: Path) -> None:
    """Up to more than an octave: free runs out of step have many minima, and a fit of the first periods has few."""
    text = (EXAMPLES / "oscillator.toml").read_text(encoding="utf-8").replace("6.0e5", "0.0").replace(
        "value = 0.0,    unit", "value = 0.0, fixed = true, unit"
    )  # fmt: skip
    truth = written(tmp_path, text, "truth.toml")
    inputs = [("fit", {"drive": wavy(1500, 5.0)})]
    data = dataset_of(
        tmp_path / "data", truth, {"drive": "V", "displacement": "mm"}, inputs, 4e-3, noise=0.01
    )
    start = written(tmp_path, changed(text, {"stiffness": factor, "damping": 0.5}), "start.toml")
    fit = rtctl.identify(data, model=start)
    assert fit.trusted
    assert fit.parameters["stiffness"].value == pytest.approx(8882.6, rel=1e-3)


def test_a_model_that_does_not_follow_is_not_trusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = written(tmp_path, TANKS)
    records = [
        Record(
            name="r",
            period_s=4.0,
            signals={"u": wavy(100, 2.0, 3.0), "y": 5.0 + np.random.default_rng(1).random(100)},
        )
    ]
    data = rtctl.write_dataset(
        tmp_path / "data",
        records,
        name="noise",
        plant="equations",
        units={"u": "V", "y": "V"},
        holds={"u": "zero"},
    )
    out = tmp_path / "out.toml"
    assert (
        main(["identify", str(data.path), "--model", str(model), "--out", str(out), "--no-plot", "--json"])
        == 1
    )
    told = json.loads(capsys.readouterr().out)
    assert told["trusted"] is False
    assert "do not use this model" in told["warnings"][0]
    assert "standard_error" not in out.read_text(encoding="utf-8")


def test_what_cannot_be_identified_is_said(tmp_path: Path) -> None:
    model = written(tmp_path, TANKS)
    inputs = [("fit", {"u": wavy(200, 2.0, 3.0)})]
    data = dataset_of(tmp_path / "data", model, {"u": "V", "y": "V"}, inputs, 4.0, noise=0.01)
    with pytest.raises(InputError, match="give its file by --model"):
        rtctl.identify(data)
    short = dataset_of(
        tmp_path / "short", model, {"u": "V", "y": "V"}, [("fit", {"u": wavy(20, 2.0, 3.0)})], 4.0, noise=0.01
    )
    with pytest.raises(InputError, match="have 20 scored samples for 7 unknowns"):
        rtctl.identify(short, model=model)
    tested = dataset_of(
        tmp_path / "tested",
        model,
        {"u": "V", "y": "V"},
        [("test", {"u": wavy(99, 2.0, 3.0)})],
        4.0,
        noise=0.01,
    )
    with pytest.raises(InputError, match='no record has use = "fit"'):
        rtctl.identify(tested, model=model)
    fixed = TANKS.replace('" }\n', '", fixed = true }\n').replace('unit = "V", fixed = true', 'unit = "V"')
    fixed = fixed.replace("initial = 3.0", "initial = 3.0, fixed = true").replace(
        'value = "c*x2", fixed = true', 'value = "c*x2"'
    )
    with pytest.raises(InputError, match="every parameter and every start is fixed"):
        rtctl.identify(data, model=written(tmp_path, fixed))


@pytest.mark.skipif(not TANK_DATA.is_dir(), reason="the measured tanks are not in the repository")
def test_the_measured_tanks_are_followed_as_well_as_published(tmp_path: Path) -> None:
    manifest = f"""
[dataset]
name = "tanks"
plant = "equations"
[signals.u]
role = "input"
unit = "V"
hold = "zero"
[signals.y]
role = "output"
unit = "V"
[[records]]
file = "{TANK_DATA}/est.csv"
sample_rate_hz = 0.25
[[records]]
file = "{TANK_DATA}/val.csv"
sample_rate_hz = 0.25
use = "test"
"""
    data = rtctl.read_dataset(written(tmp_path, manifest, "dataset.toml"))
    fit = rtctl.identify(data, model=EXAMPLES / "cascaded_tanks.toml")
    assert fit.trusted
    assert fit.residual_rms["y"] < 0.25
    assert fit.to_dict()["rms_error_test"]["val"]["y"]["value"] < 0.35
