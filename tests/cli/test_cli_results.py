"""What a run leaves: a summary with the agreed fields, the same on standard output, a folder that is whole or not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from wire_cases import settings, summary_of

from rtctl.cli import main

SHORT = settings("scenario.duration=0.05 s")
PERCENTILES = {"p50", "p99", "p99_9", "max"}


def run(model: Path, out: Path, *more: str) -> int:
    return main(["run", "steps", "--model", str(model), "--out", str(out), "--no-plot", *SHORT, *more])


def test_the_summary_has_the_agreed_fields(model_file: Path, tmp_path: Path) -> None:
    run(model_file, tmp_path, "--quiet")
    summary = summary_of(tmp_path)
    agreed = {"scenario", "verdict", "tracking", "self_sensing", "timing", "faults"}
    assert agreed <= summary.keys()
    assert summary["scenario"] == "1 s steps"
    assert summary["verdict"] in ("pass", "fail")
    assert {"mean_abs_um", "max_abs_um", "rms_um"} <= summary["tracking"].keys()
    assert {"mean_abs_um", "max_abs_um"} <= summary["self_sensing"].keys()
    timing = summary["timing"]
    times = {"lateness_us", "round_trip_us", "compute_us"}
    kept = {"missed", "requests", "histograms_us", "steps_in"}
    assert timing.keys() == {"period_s", "steps", "overruns", *times, *kept}
    assert (timing["period_s"], timing["steps"], timing["overruns"]) == (1e-3, 50, 0)
    for name in times:
        assert timing[name].keys() == PERCENTILES
        assert all(isinstance(value, float) for value in timing[name].values())
    assert timing["lateness_us"] == dict.fromkeys(PERCENTILES, 0.0), "nothing is late on a simulated clock"
    assert summary["faults"] == []
    tracking = summary["tracking"]
    assert 0.0 < tracking["mean_abs_um"] <= tracking["rms_um"] <= tracking["max_abs_um"]
    assert tracking["mean_abs_percent"] == pytest.approx(100 * tracking["mean_abs_um"] / summary["range_um"])


def test_json_prints_what_the_file_holds_and_nothing_else(
    model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(model_file, tmp_path, "--json")
    said = capsys.readouterr()
    assert json.loads(said.out) == summary_of(tmp_path)
    assert said.err == ""


def test_quiet_prints_nothing(model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(model_file, tmp_path, "--quiet")
    assert capsys.readouterr() == ("", "")
    assert (tmp_path / "summary.json").exists()


def test_a_person_reads_errors_gains_margins_and_where_the_results_are(
    model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(model_file, tmp_path)
    text = capsys.readouterr().out
    for words in ("tracking", "self-sensing", "um", "%", "gain margin", "phase margin", str(tmp_path)):
        assert words in text


def test_acquire_as_json_names_dataset_and_device(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        '[scenario]\ntitle = "x"\n[[excitation]]\nkind = "levels"\nhold = "10 ms"\nlevels = ["50 %"]\n'
    )
    assert main(["acquire", str(file), "--out", str(tmp_path / "data"), "--json"]) == 0
    said = capsys.readouterr()
    answer = json.loads(said.out)
    assert answer == {"dataset": str(tmp_path / "data" / "dataset.toml"), "device": "VO2-A"}
    assert said.err == ""
    assert Path(answer["dataset"]).is_file()


def test_a_run_that_breaks_while_writing_leaves_no_summary_of_an_older_one(
    model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(model_file, tmp_path, "--quiet")
    assert (tmp_path / "summary.json").exists()

    def no_space(*_: Any) -> None:
        raise OSError(28, "No space left on device", "signals.parquet")

    monkeypatch.setattr("rtctl.session.run_folder.write_parquet_parts", no_space)
    assert run(model_file, tmp_path, "--quiet") == 1
    assert not (tmp_path / "summary.json").exists()


def test_a_device_without_an_instrument_is_run_and_not_scored(
    model_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from drivers.inprocess import InProcessDriver

    exchange = InProcessDriver.exchange
    monkeypatch.setattr(
        InProcessDriver,
        "exchange",
        lambda self, levels: exchange(self, levels)._replace(reference=float("nan")),
    )
    assert run(model_file, tmp_path, "--quiet") == 0
    summary = summary_of(tmp_path)
    assert (summary["verdict"], summary["faults"]) == ("pass", [])
    assert set(summary["tracking"].values()) == set(summary["self_sensing"].values()) == {None}
    assert [check["met"] for check in summary["checks"]] == [None], "not measured is neither met nor missed"
