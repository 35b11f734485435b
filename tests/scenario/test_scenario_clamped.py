"""What a device does by its own limits is said, and costs no record that was whole before."""

from __future__ import annotations

from pathlib import Path

import pytest

from rtctl.cli import main
from rtctl.cli.printing.runs import print_summary
from rtctl.measured.reading import read_dataset

ACQUIRE = """
[scenario]
title = "two excitations"
[limits]
high = "9 mA"
[[excitation]]
kind = "levels"
hold = "20 ms"
levels = ["6 mA", "7 mA"]
[[excitation]]
kind = "levels"
hold = "20 ms"
levels = ["6 mA", "8.8 mA"]
"""


def test_a_clamped_excitation_is_refused_and_the_records_before_it_are_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = tmp_path / "acquire.toml"
    scenario.write_text(ACQUIRE, encoding="utf-8")
    assert main(["acquire", str(scenario), "--out", str(tmp_path / "data")]) == 1
    message = capsys.readouterr().err
    assert "clamped 20 commands between 8.8 and 8.8 mA" in message
    assert "limits.high" in message
    dataset = read_dataset(tmp_path / "data" / "dataset.toml")
    assert len(dataset.records) == 1
    assert "INCOMPLETE" in dataset.name
    assert "clamped" in dataset.incomplete


def test_a_check_on_an_infinite_error_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nothing = dict.fromkeys(("mean_abs_um", "max_abs_um", "mean_abs_percent", "max_abs_percent"))
    times = dict.fromkeys(("p50", "p99"))
    summary = {
        "scenario": "broken", "verdict": "fail", "tracking": nothing, "self_sensing": nothing, "paper": {},
        "checks": [{"check": "tracking_mean_percent", "limit": 1.0, "measured": None, "met": False}],
        "clamped_steps": 0, "clock": "lockstep", "driver": "inprocess",
        "timing": {"steps": 1, "period_s": 1e-3, "overruns": 0, "round_trip_us": times, "compute_us": times},
    }  # fmt: skip
    print_summary(summary, None, tmp_path)
    assert "check not met: tracking_mean_percent" in capsys.readouterr().out
