"""The wire changes nothing: a lockstep run over Modbus or serial frames is the in-process run, to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from wire_cases import served_process, settings, signals_of, summary_of

from rtctl.cli import main
from rtctl.models.vo2 import read_model

pytestmark = pytest.mark.wire

SHORT = {
    "steps": ["scenario.duration=0.4 s", "reference.hold=0.1 s"],
    "multisine_1_10hz": ["scenario.duration=0.4 s"],
    "random_staircase": ["excitation.0.levels=30"],
}


WIRES = ("modbus-rtu", "modbus-tcp", "serial")
QUICK = {("steps", "serial"), ("steps", "modbus-tcp"), ("random_staircase", "modbus-rtu")}


@pytest.mark.parametrize(
    ("name", "wire"),
    [
        pytest.param(name, wire, marks=[] if (name, wire) in QUICK else [pytest.mark.slow])
        for name in SHORT
        for wire in WIRES
    ],
)
def test_over_the_wire_and_in_process_agree_to_the_last_bit(
    wire: str, name: str, model_file: Path, tmp_path: Path
) -> None:
    common = ["run", name, "--model", str(model_file), "--quiet", "--no-plot", *settings(*SHORT[name])]
    main([*common, "--out", str(tmp_path / "here"), *settings("driver.seed=7", "clock.unlocked=false")])
    with served_process("vo2_a", wire, tmp_path) as there:
        main([*common, "--out", str(tmp_path / "there"), *there.settings])
    here, over = signals_of(tmp_path / "here"), signals_of(tmp_path / "there")
    assert list(here) == list(over)
    for column, values in here.items():
        np.testing.assert_array_equal(over[column], values, err_msg=column)
    assert len(np.unique(here["resistance"])) > 50, "nothing is compared where nothing moves"
    assert summary_of(tmp_path / "there")["driver"] == wire
    taken_in = summary_of(tmp_path / "there")["timing"]["steps_in"]
    assert taken_in.startswith("compiled" if name != "random_staircase" else "Python: estimator and")
    assert summary_of(tmp_path / "there")["tracking"] == summary_of(tmp_path / "here")["tracking"]


def test_acquire_identify_run_on_a_foreign_device_given_only_its_address(
    model_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, model, out = tmp_path / "data", tmp_path / "model.toml", tmp_path / "out"
    with served_process("vo2_b", "modbus-tcp", tmp_path) as there:
        assert main(["acquire", "acquire_vo2", "--out", str(data), "--quiet", *there.settings]) == 0
        quick = ["--plays", "3", "--cells", "30", "--starts", "1", "--no-plot", "--quiet"]
        assert (
            main(["identify", str(data / "dataset.toml"), "--kind", "vo2", "--out", str(model), *quick]) == 0
        )
        assert len(read_model(model).resistance_preisach.grid) == 31
        run = ["run", "steps", "--quiet", "--no-plot", *settings("scenario.duration=3 s"), *there.settings]
        assert main([*run, "--model", str(model), "--out", str(out)]) == 0
        assert capsys.readouterr() == ("", "")
        assert main([*run, "--model", str(model_file), "--out", str(tmp_path / "wrong")]) == 2
    message = capsys.readouterr().err
    assert '"VO2-A"' in message
    assert '"VO2-B"' in message
    assert not (tmp_path / "wrong" / "summary.json").exists()
    assert summary_of(out)["device"] == "VO2-B"
    assert summary_of(out)["self_sensing"]["mean_abs_percent"] < 1.0


def test_a_live_run_keeps_every_period_or_counts_it(model_file: Path, tmp_path: Path) -> None:
    live = settings(
        "clock.mode=live", "scenario.period=5 ms", "scenario.duration=0.5 s", "clock.timeout=2 s",
        "clock.watchdog=5 s",
    )  # fmt: skip
    with served_process("vo2_a", "modbus-tcp", tmp_path) as there:
        run = ["run", "steps", "--model", str(model_file), "--out", str(tmp_path), "--quiet", "--no-plot"]
        main([*run, *live, *there.settings])
    summary = summary_of(tmp_path)
    assert summary["faults"] == []
    timing = summary["timing"]
    assert timing["steps"] + timing["overruns"] == 100
    assert timing["steps"] == len(signals_of(tmp_path)["index"])
    for name in ("lateness_us", "round_trip_us", "compute_us"):
        assert (
            0.0 < timing[name]["p50"] <= timing[name]["p99"] <= timing[name]["p99_9"] <= timing[name]["max"]
        )
