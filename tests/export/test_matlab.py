"""Parameters to MATLAB and back, and equations as a function, which Octave runs where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import oscillator
from scipy.io import loadmat, savemat
from vo2_model_cases import small_model

import rtctl
from rtctl.border.errors import InputError

EXAMPLES = Path("scenarios/models/equations")


def test_parameters_come_back_from_a_mat_file_and_changed_ones_are_taken(tmp_path: Path) -> None:
    model = rtctl.read_model(oscillator(tmp_path, "friction.coulomb", "sensor.lag"))
    file = rtctl.save_mat(model, tmp_path / "beam.mat")
    assert rtctl.read_mat(file).parameters == model.parameters
    content = loadmat(file, simplify_cells=True)
    parameters = content["model"]["parameters"]
    assert parameters["sensor_lag_time_constant"] == {"value": 3.0, "unit": "ms"}
    parameters["friction_coulomb_level"]["value"] = 71.5
    savemat(file, {"model": content["model"]})
    changed = rtctl.read_mat(file)
    assert changed.parameters["friction.coulomb.level"].value == 71.5
    assert changed.mechanisms == model.mechanisms
    changed.save(tmp_path / "changed.toml")
    assert rtctl.read_model(tmp_path / "changed.toml").parameters == changed.parameters


def test_a_vo2_model_goes_to_matlab_and_back(tmp_path: Path) -> None:
    from rtctl.models.vo2 import save_model

    save_model(tmp_path / "vo2.toml", small_model())
    model = rtctl.read_model(tmp_path / "vo2.toml")
    again = rtctl.read_mat(rtctl.save_mat(model, tmp_path / "vo2.mat"))
    assert again.kind == "vo2"
    assert again.parameters == model.parameters


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda one: one["parameters"]["damping"].update(unit="1/ms"),
            'unit is "1/ms", the model file has "1/s"',
        ),
        (
            lambda one: one["parameters"]["damping"].update(value=np.array([1.0, 2.0])),
            "must be one finite number",
        ),
        (lambda one: one["parameters"].pop("damping"), "model.parameters.damping is missing"),
        (lambda one: one.pop("toml"), "no .mat file that rtctl wrote"),
    ],
)
def test_a_mat_file_that_was_spoilt_is_refused_in_words(change: object, words: str, tmp_path: Path) -> None:
    file = rtctl.save_mat(oscillator(tmp_path), tmp_path / "beam.mat")
    content = loadmat(file, simplify_cells=True)["model"]
    change(content)  # type: ignore[operator]
    savemat(file, {"model": content})
    with pytest.raises(InputError, match=words):
        rtctl.read_mat(file)


def test_a_function_has_units_defaults_and_the_equations(tmp_path: Path) -> None:
    text = rtctl.save_matlab_function(EXAMPLES / "cascaded_tanks.toml", tmp_path / "tanks.m").read_text()
    assert text.startswith("function [dx, y] = tanks(t, x, u, p)\n%TANKS")
    assert "%   x(1)  state x1 [cm]" in text
    with pytest.raises(InputError, match=r"file NAME\.m"):
        rtctl.save_matlab_function(EXAMPLES / "cascaded_tanks.toml", tmp_path / "2nd.m")
    with pytest.raises(InputError, match="events: "):
        rtctl.save_matlab_function(EXAMPLES / "bouncing_ball.toml", tmp_path / "ball.m")
    with pytest.raises(InputError, match="export it as a unit"):
        rtctl.save_matlab_function(oscillator(tmp_path), tmp_path / "beam.m")


@pytest.mark.skipif(shutil.which("octave") is None, reason="needs Octave")
@pytest.mark.parametrize("name", ["voice_coil", "cascaded_tanks", "sma_wire"])
def test_octave_computes_the_same_rates_and_outputs(name: str, tmp_path: Path) -> None:
    made = rtctl.dynamics(EXAMPLES / f"{name}.toml")
    rtctl.save_matlab_function(EXAMPLES / f"{name}.toml", tmp_path / f"{name}.m")
    x = made.initial + 0.1 * np.arange(1, len(made.initial) + 1)
    u = 0.5 * np.arange(1, len(made.inputs) + 1)
    listed = ["[" + "; ".join(repr(float(one)) for one in values) + "]" for values in (x, u)]
    program = f"[dx, y] = {name}(0.25, {listed[0]}, {listed[1]}); printf('%.17g\\n', dx, y);"
    done = subprocess.run(
        ["octave", "--no-gui", "--norc", "--eval", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    found = np.array([float(line) for line in done.stdout.split()])
    expected = np.concatenate((made.laws.rates(0.25, x, u), made.laws.read(0.25, x, u)))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)
