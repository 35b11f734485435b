"""Steps of the readings, told by their levels: a cause where a rounded model is nearer, else a remark."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, device, measured, noise_drive, write_case

from rtctl.cli import main
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.screening.steps import list_fitted, without_steps
from rtctl.measured import read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.wiring_models import build_simulation, mechanism_ids

IDS = ("friction.coulomb", "sensor.offset", "sensor.quantisation")
ROUNDED = '[[model.mechanisms]]\nid = "sensor.quantisation"\nparameters = {{ step = {{ value = {}, unit = "mm" }} }}\n'


def quantised(
    folder: Path,
    steps_of_noise: float,
    level: float = 0.0,
    more: str = "",
    *plant: dict[str, Any],
    behind: float = 0.0,
) -> Diagnosis:
    """The answer on two records to fit and one to test, with readings rounded to so many times the noise.

    `behind` is noise that is added behind the converter, as a share of the step.
    """
    bench, step = device(*plant), steps_of_noise * NOISE_MM
    records = []
    for seed, gain, use in ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test")):
        drive = noise_drive(seed, gain)
        reading = measured(bench, drive)
        rounded = level + step * np.round((reading - level) / step) if step else reading
        rounded += behind * step * np.random.default_rng(seed).normal(size=len(rounded))
        records.append((drive, rounded, use))
    manifest = write_case(folder, records)
    path = folder / "model.toml"
    path.write_text(path.read_text() + more)
    data, model = read_dataset(manifest), read_oscillator_model(path)
    return diagnose(data, model, build_simulation(model, dict(data.units), str(path)), IDS)


def test_a_coarse_step_is_a_cause_and_the_extended_model_rounds_by_it(tmp_path: Path) -> None:
    answer = quantised(tmp_path, 20.0, level=0.01)
    assert answer.verdict == "explained"
    (cause,) = answer.causes
    assert cause.id == "sensor.quantisation"
    assert cause.parameters["step"].value == pytest.approx(20.0 * NOISE_MM)
    assert cause.parameters["level"].value == pytest.approx(0.01)
    assert cause.statement.startswith("The readings have a step of 80 um, which explains 9")
    assert answer.gain is not None
    assert answer.gain.ratio_low > 1.2
    (table,) = answer.model.model.mechanisms
    assert table.id == "sensor.quantisation"
    assert table.parameters["step"].value == pytest.approx(0.08)
    assert answer.withheld == ""


@pytest.mark.slow
def test_noise_behind_the_converter_does_not_hide_its_steps(tmp_path: Path) -> None:
    friction = {"id": "friction.coulomb", "parameters": {"level": {"value": 900.0, "unit": "mm/s^2"}}}
    answer = quantised(tmp_path, 20.0, 0.01, "", friction, behind=0.05)
    assert answer.verdict == "explained"
    assert [one.id for one in answer.causes] == ["friction.coulomb", "sensor.quantisation"]
    estimated = answer.causes[1].parameters
    assert estimated["step"].value == pytest.approx(20.0 * NOISE_MM, rel=2e-3)
    assert estimated["level"].value == pytest.approx(0.01, abs=1e-3 * 0.08)
    assert answer.gain is not None
    assert answer.gain.noise_floor <= answer.gain.after


def test_a_step_of_six_times_the_noise_is_mentioned_and_one_of_the_noise_is_not(tmp_path: Path) -> None:
    for steps, said in (
        (6.0, ["the displacement readings have a step of 0.024 mm: rounding to it is 7"]),
        (1.0, []),
    ):
        answer = quantised(tmp_path, steps)
        assert (answer.verdict, answer.causes) == ("adequate", ())
        assert [one[:70] for one in answer.warnings if " step of " in one] == [one[:70] for one in said]


def test_readings_without_steps_have_none(tmp_path: Path) -> None:
    answer = quantised(tmp_path, 0.0)
    assert (answer.verdict, answer.causes) == ("adequate", ())
    assert not any(" step of " in one for one in answer.warnings)


@pytest.mark.slow
def test_a_step_stands_beside_another_cause(tmp_path: Path) -> None:
    friction = {"id": "friction.coulomb", "parameters": {"level": {"value": 900.0, "unit": "mm/s^2"}}}
    answer = quantised(tmp_path, 16.0, 0.0, "", friction)
    assert answer.verdict == "explained"
    assert [one.id for one in answer.causes] == ["friction.coulomb", "sensor.quantisation"]
    assert [one.id for one in answer.model.model.mechanisms] == ["friction.coulomb", "sensor.quantisation"]


def test_a_step_that_the_model_knows_of_is_no_cause_and_stays_in_it(tmp_path: Path) -> None:
    answer = quantised(tmp_path, 20.0, 0.0, ROUNDED.format(0.08))
    assert (answer.verdict, answer.causes) == ("adequate", ())
    answer = quantised(tmp_path, 20.0, 0.0, ROUNDED.format(0.008))  # a smaller one than the readings have
    assert [one.id for one in answer.causes] == ["sensor.quantisation"]
    (table,) = answer.model.model.mechanisms
    assert table.parameters["step"].value == pytest.approx(0.08)


def test_no_fit_sees_the_steps_of_a_model() -> None:
    rounding = {"id": "sensor.quantisation", "parameters": {"step": {"value": 0.08, "unit": "mm"}}}
    bare = without_steps(device(rounding))
    step = next(one for one in bare.parameters if one.name == "sensor.quantisation.step")
    assert (step.value, step.fixed) == (0.0, True)
    drive = noise_drive(1)
    assert np.array_equal(measured(bare, drive), measured(device(), drive))
    ids = mechanism_ids("oscillator")
    assert set(ids) - set(list_fitted(bare, ids)) == {"sensor.quantisation"}


def test_the_command_writes_the_report_and_the_model_that_simulate_takes(tmp_path: Path) -> None:
    quantised(tmp_path, 20.0)
    manifest, out = str(tmp_path / "dataset.toml"), tmp_path / "out"
    command = [
        "diagnose",
        manifest,
        "--model",
        str(tmp_path / "model.toml"),
        "--mechanisms",
        ",".join(IDS),
        "--quiet",
    ]
    assert main([*command, "--out", str(out)]) == 0
    assert "step of 80 um" in (out / "report.html").read_text()
    extended = str(out / "model-extended.toml")
    assert main(["simulate", extended, manifest, "--out", str(tmp_path / "run"), "--quiet"]) == 0
