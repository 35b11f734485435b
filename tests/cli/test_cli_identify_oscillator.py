"""`rtctl identify --kind oscillator`: from files to a model file that says what it knows, and to real data."""

from __future__ import annotations

import hashlib
import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.cli import main
from rtctl.measured.dataset import Record
from rtctl.measured.writer import write_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.wiring_models import build_simulation

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
START = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 3.0, unit = "1/s" }
stiffness = { value = 8882.6, unit = "1/s^2", fixed = true }
stiffness_cubic = { value = 300.0, unit = "1/(mm^2*s^2)" }
drive_gain = { value = 0.9, unit = "m/(s^2*(m/s^2))" }
[[model.mechanisms]]
id = "stiffness.quadratic"
parameters = { coefficient = { value = 10.0, unit = "1/(mm*s^2)" } }
"""
TRUTH = {"damping": 4.0, "stiffness": 8882.6, "stiffness_cubic": 400.0, "drive_gain": 1.0, "quadratic": 150.0}


@pytest.fixture(scope="module")
def simulation(tmp_path_factory: pytest.TempPathFactory) -> Simulation:
    path = tmp_path_factory.mktemp("truth") / "model.toml"
    text = (
        START.replace("3.0", "4.0").replace("300.0", "400.0").replace("0.9", "1.0").replace("10.0", "150.0")
    )
    path.write_text(text)
    return build_simulation(read_oscillator_model(path), {"drive": "m/s^2", "displacement": "mm"}, str(path))


@pytest.fixture(scope="module")
def manifest(simulation: Simulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two records of band noise, one of them for testing, 20 um of noise."""
    values = np.array([parameter.value for parameter in simulation.parameters])
    records = []
    for k, use in enumerate(("fit", "test")):
        draw = np.random.default_rng(70 + k)
        drive = np.convolve(draw.standard_normal(4000), np.hanning(21), mode="same")
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=1e-3)
        z = simulation.predict(stimulus, values).outputs["displacement"][0]
        measured = z + 0.02 * draw.standard_normal(len(z))
        signals = {"drive": drive, "displacement": measured}
        records.append(Record(name=f"r{k}", period_s=1e-3, signals=signals, use=use))
    return write_dataset(
        tmp_path_factory.mktemp("data"), name="band noise", plant="oscillator", records=records,
        units={"drive": "m/s^2", "displacement": "mm"}, holds={"drive": "linear"},
    )  # fmt: skip


def identify(manifest: Path, out: Path, *more: str) -> int:
    return main(["identify", str(manifest), "--kind", "oscillator", "--out", str(out), *more])


def test_a_model_with_a_mechanism_is_fitted_and_what_is_fixed_stays(manifest: Path, tmp_path: Path) -> None:
    start, out = tmp_path / "start.toml", tmp_path / "model.toml"
    start.write_text(START)
    assert identify(manifest, out, "--model", str(start), "--quiet") == 0
    model = tomllib.loads(out.read_text())["model"]
    parameters = model["parameters"]
    assert parameters["stiffness"] == {"value": 8882.6, "unit": "1/s^2", "fixed": True}
    for name in ("damping", "stiffness_cubic", "drive_gain"):
        found = parameters[name]
        assert abs(found["value"] - TRUTH[name]) < 4.0 * found["standard_error"]
        assert found["standard_error"] < 0.05 * TRUTH[name]
        half = (found["high"] - found["low"]) / 2.0
        assert half == pytest.approx(1.96 * found["standard_error"])
    assert parameters["drive_gain"]["unit"] == "m/(s^2*(m/s^2))"
    quadratic = model["mechanisms"][0]["parameters"]["coefficient"]
    assert abs(quadratic["value"] - TRUTH["quadratic"]) < 4.0 * quadratic["standard_error"]
    assert out.with_suffix(".png").stat().st_size > 20_000


def test_without_a_model_the_nominal_four_are_fitted_and_the_file_says_where_they_come_from(
    manifest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "model.toml"
    assert identify(manifest, out, "--no-plot", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    file = tomllib.loads(out.read_text())
    assert set(file["model"]["parameters"]) == {"damping", "stiffness", "stiffness_cubic", "drive_gain"}
    assert set(said["parameters"]) == set(file["model"]["parameters"])
    origin: dict[str, Any] = file["provenance"]
    assert origin["dataset"] == str(manifest)
    assert origin["sha256"]["dataset.toml"] == hashlib.sha256(manifest.read_bytes()).hexdigest()
    assert set(origin["sha256"]) == {"dataset.toml", "r0.parquet", "r1.parquet"}
    assert origin["fitted_records"] == ["r0"]
    assert origin["method"] == "output_error"
    assert origin["residual_rms"]["displacement"]["unit"] == "mm"
    assert not out.with_suffix(".png").exists()


@pytest.mark.slow
def test_a_constant_that_is_left_over_is_named(simulation: Simulation, tmp_path: Path) -> None:
    draw = np.random.default_rng(77)
    drive = np.convolve(draw.standard_normal(4000), np.hanning(21), mode="same")
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=1e-3)
    values = np.array([parameter.value for parameter in simulation.parameters])
    shifted = simulation.predict(stimulus, values).outputs["displacement"][0] + 0.5
    manifest = write_dataset(
        tmp_path / "shifted", name="shifted", plant="oscillator",
        records=[Record(name="r0", period_s=1e-3, signals={"drive": drive, "displacement": shifted})],
        units={"drive": "m/s^2", "displacement": "mm"}, holds={"drive": "linear"},
    )  # fmt: skip
    out = tmp_path / "model.toml"
    assert identify(manifest, out, "--no-plot", "--quiet") == 0
    warnings = tomllib.loads(out.read_text())["provenance"]["warnings"]
    assert any("sensor.offset" in text and "too low" in text for text in warnings)


@pytest.mark.slow
def test_columns_that_do_not_belong_together_give_no_model_to_trust(
    simulation: Simulation, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    draw = np.random.default_rng(78)
    drive, other = (np.convolve(draw.standard_normal(3000), np.hanning(21), mode="same") for _ in range(2))
    manifest = write_dataset(
        tmp_path / "mixed", name="mixed", plant="oscillator",
        records=[Record(name="r0", period_s=1e-3, signals={"drive": drive, "displacement": other})],
        units={"drive": "m/s^2", "displacement": "mm"}, holds={"drive": "linear"},
    )  # fmt: skip
    out = tmp_path / "model.toml"
    assert identify(manifest, out, "--no-plot") == 1
    assert "do not use this model" in capsys.readouterr().out
    file = tomllib.loads(out.read_text())
    assert file["provenance"]["trusted"] is False
    assert not any("low" in value for value in file["model"]["parameters"].values())


def test_a_model_that_was_written_simulates(manifest: Path, tmp_path: Path) -> None:
    start, out = tmp_path / "start.toml", tmp_path / "model.toml"
    start.write_text(START)
    assert identify(manifest, out, "--model", str(start), "--no-plot", "--quiet") == 0
    assert (
        main(["simulate", str(out), str(manifest), "--out", str(tmp_path / "sim"), "--no-plot", "--quiet"])
        == 0
    )
    rows = json.loads((tmp_path / "sim" / "summary.json").read_text())["records"]
    test = next(row for row in rows if row["use"] == "test")["outputs"]["displacement"]
    assert test["rms_error"] < 1.1 * 0.02  # the noise, and the start's first sample


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("damping = { value = 3.0", "dampin = { value = 3.0"), 'did you mean "damping"?'),
        (('value = 3.0, unit = "1/s"', 'value = 3.0, unit = "m"'), "damping"),
        (("stiffness.quadratic", "stiffness.quadratik"), 'did you mean "stiffness.quadratic"?'),
    ],
)
def test_a_wrong_start_model_is_one_message(
    manifest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], change: tuple[str, str], words: str
) -> None:
    start = tmp_path / "start.toml"
    start.write_text(START.replace(*change))
    assert identify(manifest, tmp_path / "model.toml", "--model", str(start)) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error
    assert not (tmp_path / "model.toml").exists()


def test_with_everything_fixed_there_is_nothing_to_fit(
    manifest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = tmp_path / "start.toml"
    start.write_text(START.replace('" }', '", fixed = true }').replace(", fixed = true, fixed", ", fixed"))
    assert identify(manifest, tmp_path / "model.toml", "--model", str(start)) == 2
    assert "nothing to fit" in capsys.readouterr().err


def test_data_without_a_record_to_fit_are_refused(
    manifest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    only_test = manifest.with_name("only_test.toml")
    only_test.write_text(manifest.read_text().replace('use = "fit"', 'use = "test"'))
    assert identify(only_test, tmp_path / "model.toml") == 2
    assert 'no record has use = "fit"' in capsys.readouterr().err


SILVERBOX = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 42.0, unit = "1/s" }
stiffness = { value = 1.91e5, unit = "1/s^2" }
stiffness_cubic = { value = 0.0, unit = "1/(V^2*s^2)" }
drive_gain = { value = 1.92e5, unit = "1/s^2" }
[[model.mechanisms]]
id = "stiffness.quadratic"
parameters = { coefficient = { value = 0.0, unit = "1/(V*s^2)" } }
[[model.mechanisms]]
id = "sensor.offset"
parameters = { offset = { value = 0.0, unit = "V" } }
"""


def errors_of(model: Path, manifest: Path, folder: Path) -> list[float]:
    """RMS of each record in `rtctl simulate`, in the data's unit."""
    assert main(["simulate", str(model), str(manifest), "--out", str(folder), "--no-plot", "--quiet"]) == 0
    rows = json.loads((folder / "summary.json").read_text())["records"]
    return [row["outputs"]["displacement"]["rms_error"] for row in rows]


@pytest.mark.skipif(not (DATA / "silverbox").is_dir(), reason="../shared/data/silverbox is not there")
def test_the_silverbox_comes_out_as_well_as_anybody_has_it_from_six_parameters(tmp_path: Path) -> None:
    start, out = tmp_path / "start.toml", tmp_path / "model.toml"
    start.write_text(SILVERBOX)
    manifest = DATA / "silverbox" / "dataset.toml"
    assert identify(manifest, out, "--model", str(start), "--quiet", "--no-plot") == 0
    _, multisine, arrow, within = errors_of(out, manifest, tmp_path / "sim")
    # the notes: 0.455, 0.430, 0.383 mV for a continuous model
    assert multisine < 0.455e-3
    assert arrow < 0.430e-3
    assert within < 0.383e-3


EMPS = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 1.0, unit = "1/s" }
stiffness = { value = 0.0, unit = "1/s^2", fixed = true }
drive_gain = { value = 0.008, unit = "m/s^2/N" }
[[model.mechanisms]]
id = "friction.coulomb"
parameters = { level = { value = 0.1, unit = "m/s^2" } }
[[model.mechanisms]]
id = "drive.offset"
parameters = { offset = { value = 0.0, unit = "N" } }
"""


@pytest.mark.skipif(not (DATA / "emps").is_dir(), reason="../shared/data/emps is not there")
def test_the_positioning_drive_gives_its_authors_mass_and_friction(tmp_path: Path) -> None:
    start, out = tmp_path / "start.toml", tmp_path / "model.toml"
    start.write_text(EMPS)
    manifest = DATA / "emps" / "dataset.toml"
    assert identify(manifest, out, "--model", str(start), "--quiet", "--no-plot") == 0
    model = tomllib.loads(out.read_text())["model"]
    mass = 1.0 / model["parameters"]["drive_gain"]["value"]
    level, offset = (table["parameters"] for table in model["mechanisms"])
    # its authors: 95.11 kg, 203.5 N s/m, 20.39 N, -3.16 N on the other side of the equation
    assert mass == pytest.approx(95.11, rel=0.03)
    assert mass * model["parameters"]["damping"]["value"] == pytest.approx(203.5, rel=0.12)
    assert mass * level["level"]["value"] == pytest.approx(20.39, rel=0.12)
    assert offset["offset"]["value"] == pytest.approx(3.16, rel=0.1)
    assert max(errors_of(out, manifest, tmp_path / "sim")) < 0.01  # of 0.25 m of travel
