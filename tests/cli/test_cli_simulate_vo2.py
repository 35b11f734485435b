"""`rtctl simulate` on a VO2 device: acquired in-process, its model from other noise; extended models as files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from vo2_cases import UNSEEN_NOISE

from rtctl.cli import main
from rtctl.models.vo2 import read_model, write_model
from rtctl.simulations.vo2 import extended_model, vo2_simulation

UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}


@pytest.fixture(scope="module")
def acquired(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The identification excitations on the device that the model was identified on, with other noise."""
    folder = tmp_path_factory.mktemp("acquired")
    seed = f"driver.seed={UNSEEN_NOISE}"
    assert main(["acquire", "acquire_vo2", "--out", str(folder), "--set", seed, "--quiet"]) == 0
    return folder / "dataset.toml"


def test_a_model_from_other_noise_leaves_a_thousandth_of_the_range(
    model_file: Path, acquired: Path, tmp_path: Path
) -> None:
    assert main(["simulate", str(model_file), str(acquired), "--out", str(tmp_path), "--quiet"]) == 0
    rows = json.loads((tmp_path / "summary.json").read_text())["records"]
    assert [row["use"] for row in rows] == ["identify", "identify", "identify", "fit", "test", "fit", "test"]
    width = read_model(model_file).deflection.width
    for row in rows:
        assert row["outputs"].keys() == {"resistance", "deflection"}
        table = pq.read_table(tmp_path / f"{row['record']}.parquet")
        settled = slice(20, None)  # a record may begin elsewhere than at its first current's steady state
        error = np.abs(np.asarray(table["deflection_error"])[settled])
        assert error.mean() < 0.0015 * width, row["record"]
        resistance = np.asarray(table["error"])[settled] / np.asarray(table["measured"])[settled]
        assert np.abs(resistance).mean() < 0.005, row["record"]
    assert (tmp_path / "worst.png").is_file()


def test_an_extended_file_simulates_and_runs_and_says_what_the_loop_leaves_out(
    model_file: Path, acquired: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = vo2_simulation(read_model(model_file), UNITS, "m").extended(("sensor.lag",))
    values = np.array([one.value for one in made.parameters])
    values[-1] = 5e-3
    path = tmp_path / "extended.toml"
    write_model(extended_model(made.with_values(values), {"sensor.lag.time_constant": (4e-3, 6e-3)}), path)
    assert main(["simulate", str(path), str(acquired), "--out", str(tmp_path / "s"), "--quiet"]) == 0
    worst = json.loads((tmp_path / "s" / "summary.json").read_text())["records"][3]["outputs"]["resistance"]
    assert worst["nrmse"] > 0.02, "a lag that is not there is seen"
    more = ["--model", str(path), "--out", str(tmp_path / "r"), "--set", "scenario.duration=0.05 s"]
    assert main(["run", "steps", "--no-plot", *more]) in (0, 1)
    printed = capsys.readouterr()
    assert "the loop uses sensor.lag" in printed.out + printed.err


def test_an_unknown_mechanism_in_a_file_is_named(
    model_file: Path, acquired: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = model_file.read_text() + '\n[[model.mechanisms]]\nid = "sensor.lagg"\n'
    (tmp_path / "m.toml").write_text(text)
    assert main(["simulate", str(tmp_path / "m.toml"), str(acquired), "--out", str(tmp_path), "--quiet"]) == 2
    message = capsys.readouterr().err
    assert '"sensor.lagg" is no mechanism of a vo2; did you mean "sensor.lag"?' in message
    assert "m.toml: model.mechanisms.0" in message
    table = '\n[[model.mechanisms]]\nid = "sensor.lag"\n[model.mechanisms.parameters.time_constant]\nvalue = 1.0\n'
    tables = 2 * (table + 'unit = "ms"\n')
    (tmp_path / "m.toml").write_text(model_file.read_text() + tables)
    assert main(["simulate", str(tmp_path / "m.toml"), str(acquired), "--out", str(tmp_path), "--quiet"]) == 2
    assert "mechanism sensor.lag is there twice" in capsys.readouterr().err
