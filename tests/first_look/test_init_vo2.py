"""`rtctl.init` on files of a VO2 actuator: which of them are staircases to identify, which are fitted, which test."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from first_look_cases import write_text

import rtctl
from rtctl.measured.proposal.uses.staircases import measure_staircase
from rtctl.recording import write_parquet
from rtctl.session.run_folder import run_metadata

HEAD = "t [s],I_mA,R_ohm,defl_um\n"
SWEEP = np.concatenate([np.linspace(4.0, 8.0, 60), np.linspace(8.0, 4.0, 60), np.linspace(4.0, 7.0, 45)])


def jumps(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(4.0, 8.0, 80)


def readings(
    levels: np.ndarray, hold_s: float, tau_s: float, period_s: float = 1e-3
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Current, resistance and deflection behind a heating of one time constant, with noise; the transition at 6 mA."""
    current = np.repeat(levels, round(hold_s / period_s))
    heated = np.empty_like(current)
    state = current[0]
    for k, level in enumerate(current):  # a row is read before its current acts
        heated[k] = state
        state = level + (state - level) * np.exp(-period_s / tau_s)
    phase = 1.0 / (1.0 + np.exp(-(heated - 6.0) / 0.4))
    noise = np.random.default_rng(len(current)).normal(size=(2, len(current)))
    return current, 1e5 * np.exp(-2.2 * phase + 1e-3 * noise[0]), 60.0 * phase + 0.05 * noise[1]


def write(path: Path, levels: np.ndarray, hold_s: float, tau_s: float = 2e-3) -> Path:
    columns = readings(levels, hold_s, tau_s)
    return write_text(path, HEAD, 1e-3 * np.arange(len(columns[0])), *columns)


def uses(files: list[Path], **answers: Any) -> tuple[list[str], str]:
    found = rtctl.init(files, out=files[0].parent / "new", plot=False, force=True, **answers)
    return [one.use for one in found.dataset.records], "\n".join(found.unsure)


def test_of_four_held_files_the_slow_small_steps_are_identified_and_the_file_called_test_is_the_test(
    tmp_path: Path,
) -> None:
    files = [write(tmp_path / "a.csv", SWEEP, 0.02), write(tmp_path / "b.csv", jumps(1), 0.012),
             write(tmp_path / "test.csv", jumps(2), 0.012), write(tmp_path / "z.csv", jumps(3), 0.012)]  # fmt: skip
    found, said = uses(files)
    assert found == ["identify", "fit", "test", "fit"]
    assert "identify: a.csv (a quasi-static staircase" in said
    assert "test: test.csv (its name says so)" in said
    assert 'use = "fit"  # its steps are large' in (tmp_path / "new" / "dataset.toml").read_text()


def test_where_no_name_tells_the_last_one_is_the_test(tmp_path: Path) -> None:
    files = [write(tmp_path / f"{name}.csv", jumps(k), 0.012) for k, name in enumerate("abc")]
    found, _ = uses([*files, write(tmp_path / "d.csv", SWEEP, 0.02)])
    assert found == ["fit", "fit", "test", "identify"]


def test_small_steps_that_end_before_the_device_has_settled_are_not_identified(tmp_path: Path) -> None:
    fast, slow = (
        write(tmp_path / f"{name}.csv", SWEEP, hold, 0.03) for name, hold in (("a", 0.04), ("b", 0.2))
    )
    found, said = uses([fast, slow])
    assert found == ["fit", "identify"]
    assert "of a step are still to come after its holds of 40 rows" in said


def test_a_staircase_below_the_transition_is_not_identified(tmp_path: Path) -> None:
    files = [
        write(tmp_path / "a.csv", 4.0 + 0.2 * (SWEEP - 4.0), 0.02),
        write(tmp_path / "b.csv", SWEEP, 0.02),
    ]
    assert uses(files)[0] == ["fit", "identify"]


def test_of_large_steps_alone_the_most_settled_are_identified(tmp_path: Path) -> None:
    files = [write(tmp_path / f"{name}.csv", jumps(k), hold, 0.01)
             for k, (name, hold) in enumerate({"a": 0.02, "b": 0.1, "c": 0.02}.items())]  # fmt: skip
    found, said = uses(files)
    assert found == ["fit", "identify", "test"]
    assert "nearest to a quasi-static staircase, though its steps are large" in said


def test_names_of_uses_decide_before_the_readings(tmp_path: Path) -> None:
    files = [
        write(tmp_path / f"{name}.csv", SWEEP, 0.02) for name in ("quasi_static", "run_fit", "validation")
    ]
    assert uses(files)[0] == ["identify", "fit", "test"]


def test_the_users_word_makes_a_staircase_a_test(tmp_path: Path) -> None:
    files = [write(tmp_path / f"{name}.csv", SWEEP, 0.02) for name in ("a", "b", "c")]
    found, said = uses(files)
    assert found == ["identify"] * 3
    assert "no record is left for fit and test" in said
    found, said = uses(files, test="b.csv")
    assert found == ["identify", "test", "identify"]
    assert "no record is left for fit:" in said


@pytest.mark.parametrize(("hold_s", "tau_s"), [(0.012, 2e-3), (0.04, 12e-3), (0.04, 20e-3)])
@pytest.mark.parametrize("levels", [SWEEP, jumps(5)], ids=["sweep", "jumps"])
def test_what_is_still_to_come_is_that_of_the_heating(
    levels: np.ndarray, hold_s: float, tau_s: float
) -> None:
    current, resistance, _ = readings(levels, hold_s, tau_s)
    found = measure_staircase(current, resistance)
    assert found.to_come == pytest.approx(np.exp(-hold_s / tau_s), abs=0.03, rel=0.3)


def own_recording(path: Path, command: str, **texts: str) -> Path:
    """What a command records beside the signals, with the texts that it writes into the file."""
    current, resistance, deflection = readings(SWEEP + 0.01 * np.sin(np.arange(len(SWEEP))), 0.001, 2e-3)
    columns = {"setpoint": (deflection + 0.1, "um"), "estimate": (deflection - 0.2, "um"),
               "estimate_standard_error": (0.1 + 0.01 * deflection, "um"), "deflection": (deflection, "um"),
               "resistance": (resistance, "ohm"), "current": (current, "mA"), "feedforward": (current, "mA"),
               "device_time": (1e3 * np.arange(len(current)), "us")}  # fmt: skip
    table, units = (
        {name: one[0] for name, one in columns.items()},
        {name: one[1] for name, one in columns.items()},
    )
    write_parquet(path, table, units, texts, command)
    return path


def test_the_programs_own_recording_has_its_deflection_and_a_held_current(tmp_path: Path) -> None:
    path = own_recording(tmp_path / "signals.parquet", "run", **run_metadata({"clock": {}}))
    found = rtctl.init(path, out=tmp_path / "new", plot=False)
    assert found.dataset.holds == {"current": "zero"}
    guesses = {one.name: one.column for one in found.proposal.signals}
    assert guesses == {name: name for name in ("current", "resistance", "deflection")}
    assert not any("between its rows" in one for one in found.unsure)
    assert any("timing.skew" in one for one in found.unsure)


def test_an_acquisition_was_held_too(tmp_path: Path) -> None:
    path = own_recording(tmp_path / "r00.parquet", "acquire", driver="inprocess")
    found = rtctl.init(path, out=tmp_path / "new", plot=False)
    assert found.dataset.holds == {"current": "zero"}
    assert not any("timing.skew" in one for one in found.unsure)


def test_a_simulation_written_by_the_program_says_nothing_of_the_hold(tmp_path: Path) -> None:
    path = own_recording(tmp_path / "r00.parquet", "simulate", record="r00")
    found = rtctl.init(path, out=tmp_path / "new", plot=False)
    assert found.dataset.holds == {"current": "band-limited"}
