"""Exported loops against the loop in Python: recorded runs, corners, and what cannot be exported."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from export_cases import corners_to_the_bit, replayed_to_the_bit
from firmware_cases import wait_until
from vo2_model_cases import small_model

from rtctl.api.exporting.c import export_c, replay_export, run_on_board
from rtctl.api.runs.running import run
from rtctl.border.errors import InputError
from rtctl.export.c.folder import read_manifest
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof import machines
from rtctl.export.c.proof.comparison import prove
from rtctl.export.c.proof.machines import MACHINES, emulated, missing
from rtctl.models.vo2 import write_model
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.schema import load_scenario

ESTIMATORS = ("observer", "composite", "gap_free", "preisach", "egpi")
FAST = [
    pytest.param(one, marks=[pytest.mark.slow] if one in ("preisach", "egpi") else []) for one in ESTIMATORS
]
SETTINGS = {"scenario.any_device": True, "scenario.duration": "0.15 s", "controller.feedforward": "inverse"}


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small model's file."""
    path = tmp_path_factory.mktemp("model") / "model.toml"
    write_model(small_model(), path)
    return path


@pytest.mark.parametrize("estimator", FAST)
def test_a_recorded_run_is_computed_to_the_bit(tmp_path: Path, model: Path, estimator: str) -> None:
    settings = {**SETTINGS, "estimator.kind": estimator}
    run("steps", model=model, settings=settings, out=tmp_path / "run")
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop")
    deviations = replayed_to_the_bit(tmp_path)
    assert deviations["estimate"]["max_percent"] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_machine_that_is_here_computes_the_same(tmp_path: Path, model: Path, estimator: str) -> None:
    settings = {**SETTINGS, "estimator.kind": estimator}
    run("steps", model=model, settings=settings, out=tmp_path / "run")
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop")
    proof = replay_export(tmp_path / "run", tmp_path / "loop")
    assert proof.rows == 150
    computed = [one for one in proof.computed if not one.skipped]
    assert [one.first for one in computed] == [""] * len(computed)


@pytest.mark.parametrize(("precision", "clock"), [("float", "live"), ("double", "lockstep")])
def test_corners_are_computed_to_the_bit(tmp_path: Path, model: Path, precision: str, clock: str) -> None:
    settings = [
        "controller.feedforward=inverse",
        f"clock.mode={clock}",
        "limits.rms=6.4 mA",
        "limits.rms_window=50 ms",
        "limits.slew=900 mA/s",
    ]
    export_c("steps", model=model, settings=settings, out=tmp_path / "loop")
    scenario, _ = load_scenario(find_scenario("steps"), settings)
    oracle = corners_to_the_bit(
        tmp_path / "loop",
        law_of(scenario, small_model(), read_manifest(tmp_path / "loop").extrema),
        precision,
        2000,
    )
    expected = {0, 1, 5} if clock == "live" else {0, 1, 3, 5}  # refused readings, and too much power
    assert expected <= set(np.unique(oracle["fault"]).tolist())


def test_one_wrong_operation_is_found(tmp_path: Path, model: Path) -> None:
    run("steps", model=model, settings=SETTINGS, out=tmp_path / "run")
    export_c("steps", model=model, settings=SETTINGS, out=tmp_path / "loop")
    source = tmp_path / "loop" / "rtctl.c"
    text = source.read_text()
    exact = "power + (x.at[0] - power) * a"
    assert exact in text
    source.write_text(
        text.replace(exact, "x.at[0] * a + power * (R(1.0) - a)")
    )  # the same but for its rounding
    assert not prove(tmp_path / "loop", tmp_path / "run", ["gcc"]).same


def test_a_folder_of_another_scenario_is_refused(tmp_path: Path, model: Path) -> None:
    export_c("steps", model=model, settings=SETTINGS, out=tmp_path / "loop")
    run("steps", model=model, settings=SETTINGS | {"limits.high": "8.1 mA"}, out=tmp_path / "run")
    with pytest.raises(InputError, match='exported from the scenario "steps", whose gains, limits or times'):
        prove(tmp_path / "loop", tmp_path / "run", machines=())
    wire = {"driver.kind": "serial", "driver.port": "/nowhere", "limits.high": "8.1 mA"}
    with pytest.raises(InputError, match="are not those of this run"):
        run_on_board(
            "steps", board=tmp_path / "loop", model=model, settings=SETTINGS | wire, out=tmp_path / "b"
        )


def test_a_folder_of_another_model_is_refused(tmp_path: Path, model: Path) -> None:
    run("steps", model=model, settings=SETTINGS, out=tmp_path / "run")
    other = tmp_path / "other.toml"
    other.write_text(model.read_text() + "\n")
    export_c("steps", model=other, settings=SETTINGS, out=tmp_path / "loop")
    with pytest.raises(InputError, match="another model"):
        replay_export(tmp_path / "run", tmp_path / "loop")


@pytest.mark.parametrize(
    ("scenario", "settings", "what"),
    [
        ("steps", {"limits.stop": True}, "limits.stop"),
        ("random_staircase", {}, "no \\[reference\\]"),
    ],
)
def test_what_cannot_be_exported_is_named(
    tmp_path: Path, model: Path, scenario: str, settings: dict[str, object], what: str
) -> None:
    with pytest.raises(InputError, match=what):
        export_c(scenario, model=model, settings=settings, out=tmp_path)


def test_an_emulator_that_computes_nothing_leaves_no_proof_of_an_earlier_run(tmp_path: Path) -> None:
    left = tmp_path / "out.bin"
    left.write_bytes(b"of a run before")
    with pytest.raises(InputError, match=r"board: the emulator computed nothing \(exit 3\): no such machine"):
        emulated(["sh", "-c", "echo no such machine >&2; exit 3"], left, "board")
    assert not left.exists()
    assert emulated(["sh", "-c", "printf bits > out.bin"], left, "board") == b"bits"


def test_an_emulator_that_hangs_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machines, "LONGEST_S", 0.2)
    with pytest.raises(InputError, match=r"board: the emulator was stopped after 0\.2 s"):
        emulated(["sleep", "20"], tmp_path / "out.bin", "board")


def test_a_missing_compiler_is_one_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None if name == "arm-none-eabi-gcc" else name)
    assert missing(MACHINES["m4f"]) == (
        "arm-none-eabi-gcc not found (Debian: apt-get install make gcc-arm-none-eabi libnewlib-arm-none-eabi "
        "qemu-system-arm)"
    )


@pytest.mark.slow
@pytest.mark.wire
def test_the_loop_on_the_emulated_board_tracks_as_the_one_in_python(tmp_path: Path, model_file: Path) -> None:
    if missing(MACHINES["m4f"]):
        pytest.skip(missing(MACHINES["m4f"]))
    settings = {"scenario.duration": "0.5 s"}
    export_c("steps", model=model_file, settings=settings, out=tmp_path / "loop")
    port = tmp_path / "line"
    command = [sys.executable, "-m", "rtctl", "serve", "vo2_a", "--serial", str(port)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as device:
        try:
            wait_until(port.exists, "the device did not start")
            wire = {**settings, "driver.kind": "serial", "driver.port": str(port)}
            there = run_on_board(
                "steps", board=tmp_path / "loop", model=model_file, settings=wire, out=tmp_path / "board"
            )
        finally:
            device.terminate()
    here = run("steps", model=model_file, settings=settings).summary
    assert there.summary["verdict"] == here["verdict"] == "pass"
    more = there.summary["tracking"]["mean_abs_percent"] - here["tracking"]["mean_abs_percent"]
    assert abs(more) < 0.02


def test_a_board_needs_a_serial_line(tmp_path: Path, model: Path) -> None:
    with pytest.raises(InputError, match="serial line in lockstep"):
        run_on_board("steps", board=tmp_path, model=model, out=tmp_path / "board")
