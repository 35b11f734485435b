"""Data files of a plant of one's own equations become a manifest by one command, by a model file or by names."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from first_look_cases import write_text

import rtctl
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.cli.dialogue import ask_all
from rtctl.measured.proposal.proposal import Answers
from rtctl.measured.proposal.survey import survey_files

MODEL = """[model]
kind = "equations"
[model.inputs]
U = { unit = "V" }
[model.states]
heater = { unit = "K", rate = "(U^2/R - loss*(heater - room))/C", initial = 296.15 }
[model.outputs]
T = { unit = "K", value = "heater" }
[model.parameters]
R = { value = 12.0, unit = "ohm", fixed = true }
loss = { value = 1.5, unit = "W/K", low = 0 }
C = { value = 40.0, unit = "J/K", low = 0.1 }
room = { value = 296.15, unit = "K", fixed = true }
"""
TANKS = """[model]
kind = "equations"
[model.inputs]
q = { unit = "L/min" }
[model.states]
h1 = { unit = "cm", rate = "(q - k*h1)/S" }
h2 = { unit = "cm", rate = "k*(h1 - h2)/S" }
[model.outputs]
y1 = { unit = "cm", value = "h1" }
y2 = { unit = "cm", value = "h2" }
[model.parameters]
k = { value = 1.0, unit = "cm^2/s" }
S = { value = 154.0, unit = "cm^2", fixed = true }
"""
HEAD = "t_s,U_heater_V,T_plate_degC\n"


def heated(folder: Path, head: str = HEAD, name: str = "run.csv") -> Path:
    """Write 600 s of a heater of C T' = U^2/R - loss (T - room) under held voltages, and the model beside it."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(0.0, 20.0, 20), 30)
    rise = np.zeros(600)
    for k in range(1, 600):
        rest = u[k - 1] ** 2 / (12.0 * 1.6)
        rise[k] = rest + (rise[k - 1] - rest) * np.exp(-1.6 / 50.0)
    (folder / "heater.toml").write_text(MODEL, encoding="utf-8")
    return write_text(folder / name, head, np.arange(600.0), u, 23.0 + rise + 0.01 * rng.normal(size=600))


def test_a_model_file_names_the_signals_and_the_next_command_identifies_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    heated(tmp_path)
    assert main(["init", "run.csv", "--yes", "--model", "heater.toml", "--no-plot"]) == 0
    words = shlex.split(capsys.readouterr().out.strip().splitlines()[-1].removeprefix("now run: "))
    assert words[1:5] == ["identify", "dataset.toml", "--model", "heater.toml"]
    data = rtctl.read_dataset("dataset.toml")
    assert data.plant == "equations"
    assert data.units == {"U": "V", "T": "K"}
    assert float(data.records[0].signals["T"][0]) == pytest.approx(296.15, abs=0.1)
    assert main([*words[1:], "--no-plot", "--quiet", "--starts", "1"]) == 0
    found = rtctl.read_model("model.toml").parameters
    assert found["loss"].value == pytest.approx(1.6, rel=0.01)
    assert found["C"].value == pytest.approx(50.0, rel=0.01)


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        (
            "t_s,T [V],T_degC\n",
            {"U": "T [V]", "T": "T_degC"},
        ),  # the unit decides between two that are called T
        ("t [s],voltage [V],plate [degC]\n", {"U": "voltage [V]", "T": "plate [degC]"}),
    ],
)
def test_columns_are_found_by_name_then_by_unit(tmp_path: Path, head: str, columns: dict[str, str]) -> None:
    found = rtctl.init(heated(tmp_path, head), model=tmp_path / "heater.toml", plot=False)
    assert {one.name: one.column for one in found.proposal.signals} == columns


def test_a_unit_is_not_taken_from_the_model(tmp_path: Path) -> None:
    path = heated(tmp_path, "t [s],log.U,log.T\n")
    with pytest.raises(rtctl.InputError, match=r"--input U=log\.U:UNIT --output T=log\.T:UNIT"):
        rtctl.init(path, model=tmp_path / "heater.toml", plot=False)
    found = rtctl.init(
        path, model=tmp_path / "heater.toml", inputs="log.U:V", outputs="T=log.T:degC", plot=False
    )
    assert found.dataset.units == {"U": "V", "T": "K"}


def test_options_name_the_signals_where_no_model_is_written_yet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = heated(tmp_path)
    options = ["--plant", "equations", "--input", "U_heater_V", "--output", "T=T_plate_degC"]
    assert main(["init", str(path), "--yes", "--no-plot", *options]) == 0
    said = capsys.readouterr().out
    assert "now run" not in said, "rtctl identify needs a model, which is not there"
    assert "write the equations with inputs and outputs of these names" in said
    assert set(rtctl.read_dataset(tmp_path / "dataset.toml").units) == {"U_heater", "T"}
    text = (tmp_path / "dataset.toml").read_text(encoding="utf-8")
    assert "offset = 273.15" in text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ["--plant", "equations"],
            ["--model MODEL.toml", "--input U_heater=U_heater_V --output T_plate=T_plate_degC"],
        ),
        ([], ["where no motion was measured: --model MODEL.toml", "run.csv --model MODEL.toml"]),
        (["--model", "heater.toml", "--plant", "vo2"], ["contradict each other", "leave out --plant"]),
        (["--model", "no.toml"], ["no.toml"]),
        (["--model", "other.toml"], ['key "model.kind" is None']),
        (["--plant", "equations", "--output", "T=nothing"], ['no column "nothing"']),
    ],
)
def test_what_is_not_told_is_refused_without_a_traceback_or_a_wrong_advice(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    told: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    heated(tmp_path)
    Path("other.toml").write_text("[other]\nx = 1\n", encoding="utf-8")
    assert main(["init", "run.csv", "--yes", *words]) == 2
    said = capsys.readouterr().err
    assert [one for one in told if one not in said] == []
    assert "displacement=T" not in said
    assert not Path("dataset.toml").exists()


def test_the_dialogue_asks_for_the_model_or_for_the_columns(tmp_path: Path) -> None:
    surveys = survey_files([heated(tmp_path)])
    told = iter(["equations", str(tmp_path / "heater.toml"), *[""] * 8])
    found = ask_all(surveys, Answers(), lambda _: next(told))
    assert {one.name: (one.column, one.unit) for one in found.signals} == {
        "U": ("U_heater_V", "V"), "T": ("T_plate_degC", "degC"),
    }  # fmt: skip
    told = iter(["equations", "-", "U_heater_V", "T_plate_degC", *[""] * 6])
    found = ask_all(surveys, Answers(), lambda _: next(told))
    assert [one.name for one in found.signals] == ["U_heater", "T_plate"]
    assert found.opens == ()


def test_fahrenheit_gets_scale_and_offset(tmp_path: Path) -> None:
    path = heated(tmp_path, "t_s,U_V,T_degF\n")
    data = rtctl.init(path, model=tmp_path / "heater.toml", plot=False).dataset
    first = float(np.loadtxt(path, delimiter=",", skiprows=1)[0, 2])
    assert float(data.records[0].signals["T"][0]) == pytest.approx((first + 459.67) / 1.8, rel=1e-9)


@pytest.mark.parametrize("signal", ["displacement", "velocity", "acceleration"])
def test_a_motion_in_newtons_is_refused_by_init_and_in_a_manifest(tmp_path: Path, signal: str) -> None:
    path = write_text(
        tmp_path / "r.csv", "t [s],u [V],x [N]\n", *np.random.default_rng(0).normal(size=(3, 100)).cumsum(1)
    )
    with pytest.raises(InputError, match="as a force is: it cannot be the"):
        rtctl.init(path, outputs={signal: "x [N]"}, sample_rate_hz=100.0, plot=False)
    (tmp_path / "d.toml").write_text(
        '[dataset]\nname = "n"\nplant = "oscillator"\n[signals.drive]\nrole = "input"\nunit = "V"\ncolumn = "u [V]"\n'
        f'[signals.{signal}]\nrole = "output"\nunit = "N"\ncolumn = "x [N]"\n[[records]]\nfile = "r.csv"\n'
        "sample_rate_hz = 100.0\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match='"N" is a unit like N, which this signal cannot be'):
        rtctl.read_dataset(tmp_path / "d.toml")


@pytest.mark.parametrize(
    ("rate", "words"),
    [
        ("(U^2/R - loss*(heater - rom))/C", '"rom" is unknown; did you mean "room"'),
        ("(U^2/R - loss*heater*heater)/C", "both need one unit"),
        ("(U^2/R - loss*(heater - room)/C", "model.states.heater.rate"),
    ],
)
def test_equations_with_an_error_stop_init_with_the_message_of_identify(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rate: str, words: str
) -> None:
    path = heated(tmp_path)
    model = tmp_path / "heater.toml"
    model.write_text(MODEL.replace("(U^2/R - loss*(heater - room))/C", rate), encoding="utf-8")
    assert main(["init", str(path), "--yes", "--model", str(model), "--no-plot"]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "dataset.toml").exists()
    with pytest.raises(InputError, match=words.split("?")[0][:20]):  # as Python says it
        rtctl.init(path, model=model, plot=False)


def test_an_example_has_no_column_twice_and_works(tmp_path: Path) -> None:
    """Two levels in cm, two outputs in cm: the example had the first column for both, and was refused."""
    time = np.arange(200.0)
    path = write_text(
        tmp_path / "tanks.csv", "t [s],q [L/min],upper [cm],lower [cm]\n",
        time, 2.0 + np.sin(time / 9.0), 5.0 + np.sin(time / 11.0), 3.0 + np.sin(time / 17.0),
    )  # fmt: skip
    (tmp_path / "two.toml").write_text(TANKS, encoding="utf-8")
    with pytest.raises(InputError, match="for example") as refused:
        rtctl.init(path, model=tmp_path / "two.toml", plot=False)
    words = shlex.split(str(refused.value).rpartition("for example: ")[2])
    named = [words[k + 1].partition("=")[2] for k, word in enumerate(words) if word == "--output"]
    assert named == ["upper [cm]", "lower [cm]"]
