"""Another model takes over while the loop runs: without a bump, within the limits, and equal to the bit in a replay."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.model_file import Value
from rtctl.loop.events import read_events
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.loop.supervisor import LoopOutcome
from rtctl.models.vo2 import read_model, write_model
from rtctl.scenario.schema import load_scenario
from rtctl.session.closed_loop import track
from rtctl.session.live import successors
from rtctl.session.run_files import RunResult, write_run
from rtctl.session.run_folder import RunFolder, run_metadata
from rtctl.wiring import build_driver

SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "multisine_1_10hz.toml"
AT = 1500


def run_of(
    folder: Path, model_file: Path, numbers: list[int], *, unlocked: bool
) -> tuple[RunResult, LoopOutcome, list[str]]:
    """Run 4 s; after each further `AT` samples the next of the models in `folder` takes over."""
    settings = ["scenario.duration=4 s", "driver.seed=42", f"clock.unlocked={str(unlocked).lower()}"]
    scenario, tables = load_scenario(SCENARIO, settings)
    model, changes, waiting = read_model(model_file), ParameterChannel(), list(numbers)
    calls, said = 0, []

    def stop_requested() -> bool:
        nonlocal calls
        calls += 1
        if waiting and calls >= AT * (len(numbers) - len(waiting) + 1):
            try:
                said.append(changes.offer_model(waiting.pop(0)))
            except InputError as error:
                said.append(str(error))
        return False

    driver = build_driver(scenario, SCENARIO.parent)
    place = RunFolder(path=folder, metadata=run_metadata(tables), model=model_file)
    result, outcome = track(scenario, model, driver, stop_requested, place, changes)
    write_run(folder, scenario, tables, result, plot=False)
    return result, outcome, said


def taken_over(folder: Path) -> list[tuple[int, int]]:
    """Sample and number of each model that took over."""
    found = read_events(folder / "events.jsonl")
    return [(event.step, event.values["number"]) for event in found if event.kind == "model"]


def current(result: RunResult) -> FloatArray:
    return np.asarray(result.signals["current"])


@pytest.mark.parametrize("unlocked", [False, True], ids=["in Python", "in compiled blocks"])
def test_the_same_model_takes_over_without_a_bump(
    tmp_path: Path, model_file: Path, *, unlocked: bool
) -> None:
    plain, *_ = run_of(tmp_path / "plain", model_file, [], unlocked=unlocked)
    result, outcome, said = run_of(tmp_path / "run", model_file, [0], unlocked=unlocked)
    assert outcome.fault is None
    assert said[0].startswith("PI: kp")
    (at, number), = taken_over(tmp_path / "run")  # fmt: skip
    assert number == 0
    assert at >= AT - 100
    np.testing.assert_array_equal(current(result)[:at], current(plain)[:at])
    # the same estimator after the same rows: what differs is the rounding of the integral term
    np.testing.assert_allclose(current(result), current(plain), rtol=0.0, atol=1e-9)
    assert rtctl.replay(tmp_path / "run").same


@pytest.mark.parametrize("until", [None, 1000], ids=["right from the start", "right since sample 1000"])
@pytest.mark.parametrize("history_s", [20.0, 0.8], ids=["all of the run", "its last 0.8 s"])
def test_an_extended_model_takes_over_and_the_first_one_comes_back(
    tmp_path: Path, model_file: Path, monkeypatch: pytest.MonkeyPatch, until: int | None, history_s: float
) -> None:
    monkeypatch.setattr(successors, "HISTORY_S", history_s)
    folder = tmp_path / "run"
    folder.mkdir()
    if until is not None:
        successors.write_onset(folder, 1, successors.Onset(0, until, None, -1))
    shifted = {"resistance_offset": Value(value=0.1, unit="dimensionless")}
    write_model(replace(read_model(model_file), corrections=shifted), folder / "retuned-1.toml")
    result, outcome, said = run_of(folder, model_file, [1, 0], unlocked=True)
    assert outcome.fault is None
    assert "the loop uses resistance_offset" in said[0]
    (first, one), (second, none) = taken_over(folder)
    assert (one, none) == (1, 0)
    u = current(result)
    usual = np.abs(np.diff(u[200:first])).max()
    assert np.abs(np.diff(u[first - 1 : first + 3])).max() <= usual
    assert np.abs(np.diff(u[second - 1 : second + 3])).max() <= 2.0 * usual
    estimate, deflection = result.signals["estimate"], result.signals["deflection"]
    off = np.abs(estimate - deflection)
    # a shift that is not there makes the estimate worse: it was really the other estimator
    assert np.mean(off[first + 200 : second]) > 1.5 * np.mean(off[200:first])
    assert np.mean(off[second + 500 :]) < 1.5 * np.mean(off[200:first])
    assert rtctl.replay(folder).same
    assert u.max() <= 8.49


def test_what_cannot_take_over_changes_nothing(tmp_path: Path, model_file: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    write_model(replace(read_model(model_file), identity="another"), folder / "retuned-1.toml")
    _, outcome, said = run_of(folder, model_file, [1, 2], unlocked=True)
    assert outcome.fault is None
    assert "a model of another device than the run's" in said[0]
    assert "retuned-2.toml: missing" in said[1]
    assert taken_over(folder) == []
