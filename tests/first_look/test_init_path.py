"""Two commands from a file to an answer: init, identify, and simulate on the record that no fit saw."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest
from first_look_cases import motion, write_text

import rtctl
from rtctl.cli import main


def test_from_a_file_to_a_model_that_holds_on_the_test_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    m = motion(9000, 1000.0, 4)
    write_text(
        Path("run 7.csv"), "Zeit [s];Spannung [V];Weg [mm]\n", m.t, m.u, m.x, separator=";", comma=True
    )
    assert main(["init", "run 7.csv", "--yes"]) == 0
    assert Path("preview.png").stat().st_size > 20_000
    words = shlex.split(capsys.readouterr().out.strip().splitlines()[-1].removeprefix("now run: "))[1:]
    assert words == ["diagnose", "dataset.toml", "--out", "answer"], "which identifies a model first"
    assert main(["identify", "dataset.toml", "--out", "model.toml", "--no-plot"]) == 0
    found = rtctl.read_model("model.toml").parameters
    assert found["damping"].value == pytest.approx(8.0, rel=0.01)
    assert found["stiffness"].value == pytest.approx(8882.6, rel=0.001)
    assert found["drive_gain"].value == pytest.approx(300.0, rel=0.01)
    assert main(["simulate", "model.toml", "dataset.toml", "--out", "sim", "--no-plot", "--quiet"]) == 0
    rows = json.loads(Path("sim/summary.json").read_text())["records"]
    (test,) = [row for row in rows if row["use"] == "test"]
    assert test["outputs"]["displacement"]["nrmse"] < 0.002, (
        "its start in motion must not be scored as an error"
    )


def test_python_gives_path_guesses_and_summary_and_never_asks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> str:
        raise AssertionError("a question in Python")

    monkeypatch.setattr("builtins.input", never)
    m = motion(600)
    path = write_text(tmp_path / "r.csv", "t,u,x\n", m.t, m.u, m.x)
    with pytest.raises(rtctl.InputError, match="nobody states the unit"):
        rtctl.init(path)
    found = rtctl.init([str(path)], inputs=["u:V"], outputs={"displacement": "x:mm"}, plot=False)
    assert found.path == tmp_path / "dataset.toml"
    assert found.picture is None
    assert found.guessed["signals.drive.unit"] == "given"
    assert found.guessed["signals.displacement.column"] == "you said so"
    assert [one.name for one in found.summary.signals] == ["drive", "displacement"]
    assert found.next_command[:2] == ("rtctl", "diagnose")
    assert "r.csv" not in repr(found)
    assert json.dumps(found.to_dict())
    assert "displacement" in found._repr_html_()


def test_a_test_record_begins_where_the_fit_does_so_that_a_drift_counts_from_the_same_instant(
    tmp_path: Path,
) -> None:
    m = motion(6000, 1000.0, 4)
    write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", m.t, m.u, m.x)
    fit, test = rtctl.init(tmp_path / "r.csv", plot=False).dataset.records
    assert (fit.samples, fit.ignore_first) == (4000, 0)
    assert (test.samples, test.ignore_first, test.use) == (6000, 4000, "test")
    assert test.signals["displacement"][0] == fit.signals["displacement"][0]
