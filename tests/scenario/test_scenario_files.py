"""Every bundled scenario loads, runs on the simulated clock, meets its checks, and repeats to the byte."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from vo2_cases import SCENARIOS
from wire_cases import settings, signals_of, summary_of

from rtctl.cli import main
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.command_sequence import command_sequences
from rtctl.scenario.schema import load_scenario

FILES = sorted(SCENARIOS.glob("*.toml"))
RUNS = [file.stem for file in FILES if not file.stem.startswith("acquire")]
ELSEWHERE = ("piezo_steps", "vo2_mirror_steps", "sma_steps")
"""Scenarios whose whole runs are slow: of kinds that others have, or run in part by other tests."""
REPEATED = ("steps", "me_amplitude")
"""One of each kind of plant that is run twice in every check; the others are repeated weekly."""


def run(name: str, model: Path, out: Path, *overrides: str, plot: bool = False) -> int:
    """With `model` where the scenario does not name its own."""
    scenario, _ = load_scenario(find_scenario(name), [])
    given = [] if scenario.scenario.model else ["--model", str(model)]
    drawn = [] if plot else ["--no-plot"]
    return main(["run", name, *given, "--out", str(out), "--quiet", *drawn, *settings(*overrides)])


def test_the_scenarios_that_were_asked_for_are_there() -> None:
    assert len(RUNS) >= 7
    assert (SCENARIOS / "acquire_vo2.toml").is_file()


@pytest.mark.parametrize("use", ["fit", "test"])
def test_the_acquisition_has_single_small_steps_after_jumps_that_a_source_may_ignore(use: str) -> None:
    scenario, _ = load_scenario(SCENARIOS / "acquire_vo2.toml", [])
    whole = sum(map(len, command_sequences(scenario)))
    levels = command_sequences(scenario)[5 if use == "fit" else 6]
    assert scenario.excitation[5 if use == "fit" else 6].use == use
    steps = np.diff(levels)
    steps = np.abs(steps[steps != 0.0]) / (scenario.limits.high - scenario.limits.low)
    small, before = steps[1::3], steps[::3]
    assert before.min() > 0.3
    assert np.sum(small < 0.01) >= 5
    assert np.sum((small > 0.01) & (small < 0.031)) >= 5
    assert len(levels) < 0.05 * whole


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_file_says_what_it_claims(file: Path) -> None:
    scenario, _ = load_scenario(file, [])
    assert scenario.driver.kind == "inprocess"
    if file.stem in RUNS:
        assert scenario.checks.bounds(), "a scenario without checks always passes"


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in ELSEWHERE else []) for name in RUNS]
)
def test_it_meets_its_checks(name: str, model_file: Path, tmp_path: Path) -> None:
    assert run(name, model_file, tmp_path, plot=True) == 0
    summary = summary_of(tmp_path)
    assert summary["verdict"] == "pass"
    assert all(check["met"] for check in summary["checks"])
    assert summary["checks"]
    assert (tmp_path / "run.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in REPEATED else [pytest.mark.slow]) for name in RUNS]
)
def test_it_repeats_to_the_byte(name: str, model_file: Path, tmp_path: Path) -> None:
    folders = tmp_path / "one", tmp_path / "two"
    for folder in folders:
        assert run(name, model_file, folder) == 0
        assert not (folder / "run.png").exists()
    first, second = (folder / "signals.parquet" for folder in folders)
    assert first.read_bytes() == second.read_bytes()


def test_another_seed_gives_another_recording(model_file: Path, tmp_path: Path) -> None:
    for seed in (1, 2):
        run("steps", model_file, tmp_path / str(seed), "scenario.duration=0.05 s", f"driver.seed={seed}")
    one, two = (signals_of(tmp_path / str(seed))["resistance"] for seed in (1, 2))
    assert (one != two).mean() > 0.3


def test_checks_that_are_not_met_are_a_fail_and_exit_1(model_file: Path, tmp_path: Path) -> None:
    strict = ("scenario.duration=0.05 s", "checks.tracking_mean_percent=1e-6")
    assert run("steps", model_file, tmp_path, *strict) == 1
    summary = summary_of(tmp_path)
    assert (summary["verdict"], summary["faults"]) == ("fail", [])
    assert [check["met"] for check in summary["checks"]] == [False]


@pytest.mark.parametrize("estimator", ["composite", "gap_free", "preisach", "egpi"])
def test_each_estimator_closes_the_loop_by_one_line_of_the_scenario(
    estimator: str, model_file: Path, tmp_path: Path
) -> None:
    run("steps", model_file, tmp_path, f"estimator.kind={estimator}", "scenario.duration=2 s")
    summary = summary_of(tmp_path)
    assert summary["estimator"] == estimator
    assert summary["faults"] == []
    assert summary["tracking"]["mean_abs_percent"] < 10.0


def test_the_recording_knows_its_units_and_the_scenario_as_it_was_run(
    model_file: Path, tmp_path: Path
) -> None:
    run("steps", model_file, tmp_path, "scenario.duration=0.05 s")
    schema = pq.read_schema(tmp_path / "signals.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert (units["deflection"], units["resistance"], units["current"]) == ("um", "ohm", "mA")
    assert b'duration = "0.05 s"' in schema.metadata[b"scenario"]


def test_an_open_loop_run_plays_every_excitation(model_file: Path, tmp_path: Path) -> None:
    part = '\n[[excitation]]\nkind = "levels"\nhold = "10 ms"\nlevels = ["{} %"]\n'
    file = tmp_path / "two.toml"
    file.write_text('[scenario]\ntitle = "two"\n' + part.format(20) + part.format(70))
    assert run(str(file), model_file, tmp_path / "out") == 0
    current = signals_of(tmp_path / "out")["current"]
    assert current.tolist() == pytest.approx(10 * [3.68 + 0.2 * 4.81] + 10 * [3.68 + 0.7 * 4.81])
