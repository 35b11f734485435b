"""The last line of a verb is the next command, which can be typed as it stands; scripts do not hear of it."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from rtctl.cli import build_parser, main
from rtctl.cli.next_step import answer_folder

SHORT = [
    "--set",
    "excitation.0.duration=4 s",
    "--set",
    "excitation.1.duration=2 s",
    "--set",
    "excitation.2.duration=2 s",
]


def next_of(said: str) -> list[str]:
    """The words of the next command after `rtctl`, from the last line."""
    last = said.strip().splitlines()[-1]
    assert last.startswith("now run: rtctl "), said
    words = shlex.split(last.removeprefix("now run: "))[1:]
    build_parser().parse_args(words)
    return words


def test_each_step_names_the_next_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["acquire", "acquire_oscillator", "--out", "my data", *SHORT]) == 0
    words = next_of(capsys.readouterr().out)
    assert words == ["identify", "my data/dataset.toml", "--out", "my data/model.toml"]
    main([*words, "--no-plot", "--starts", "1"])
    words = next_of(capsys.readouterr().out)
    assert words == ["diagnose", words[1], "--model", "my data/model.toml", "--out", "my data/diagnosis"]
    assert main(["simulate", "my data/model.toml", "my data/dataset.toml", "--out", "sim", "--no-plot"]) == 0
    assert next_of(capsys.readouterr().out)[0] == "diagnose"
    for option in ("--json", "--quiet"):
        main(["simulate", "my data/model.toml", "my data/dataset.toml", "--out", "sim", "--no-plot", option])
        said = capsys.readouterr().out
        assert "now run" not in said
        if option == "--json":
            json.loads(said)


def test_a_run_names_what_can_be_asked_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for scenario, verb, setting in (
        ("sine_1hz", "doubt", "scenario.duration=15 s"),
        ("me_amplitude", "watch", ""),
    ):
        out = str(tmp_path / scenario)
        main(["run", scenario, "--no-plot", "--out", out, *(["--set", setting] if setting else [])])
        words = next_of(capsys.readouterr().out)
        assert words == [verb, out]
    assert main(["doubt", str(tmp_path / "sine_1hz")]) == 0


def test_a_preview_goes_on_to_the_diagnosis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["acquire", "acquire_oscillator", "--out", str(tmp_path), *SHORT, "--quiet"]) == 0
    assert main(["preview", str(tmp_path / "dataset.toml")]) == 0
    words = next_of(capsys.readouterr().out)
    assert words == ["diagnose", str(tmp_path / "dataset.toml"), "--out", str(tmp_path / "answer")]


@pytest.mark.slow
def test_a_diagnosis_ends_with_the_experiment_or_the_extended_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["acquire", "acquire_oscillator", "--out", "data", *SHORT, "--quiet"]) == 0
    assert main(
        ["identify", "data/dataset.toml", "--out", "m.toml", "--no-plot", "--quiet", "--starts", "1"]
    ) in (0, 1)
    words = ["diagnose", "data/dataset.toml", "--model", "m.toml", "--out", "answer"]
    assert main([*words, "--mechanisms", "stiffness.quintic"]) == 0
    after = next_of(capsys.readouterr().out)
    assert after[0] in ("acquire", "simulate")
    assert "What was read: 2 signals, 3 records" in Path("answer/report.html").read_text(encoding="utf-8")
    assert Path(after[1]).is_file()


def test_the_folder_of_an_answer_follows_the_model_and_no_earlier_answer_is_in_it(tmp_path: Path) -> None:
    assert answer_folder(tmp_path, Path("model.toml")) == tmp_path / "diagnosis"
    assert answer_folder(tmp_path, tmp_path / "model2.toml") == tmp_path / "diagnosis2"
    assert answer_folder(tmp_path, Path("beam.toml")) == tmp_path / "diagnosis-beam"
    for taken, then in (("diagnosis", "diagnosis-2"), ("diagnosis-2", "diagnosis-3")):
        (tmp_path / taken).mkdir()
        (tmp_path / taken / "diagnosis.json").touch()
        assert answer_folder(tmp_path, Path("model.toml")) == tmp_path / then
