"""An exported resonator's loop, lock-in with AGC and PLL, against the loop in Python, to the bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from export_cases import corners_to_the_bit, replayed_to_the_bit, same_on_every_machine

from rtctl.api.exporting.c import export_c, run_on_board
from rtctl.api.runs.running import run
from rtctl.border.errors import InputError
from rtctl.export.c.laws.planning import law_of
from rtctl.models.resonator import read_resonator
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.schema import load_scenario

MODEL = find_scenario("me_amplitude").parent / "models" / "me_a.toml"
SHORT = {"scenario.duration": "0.9 s"}
"""Kick, engagement, and a step down and up."""
LATE = """
[[model.mechanisms]]
id = "drive.delay"
parameters = { delay = { value = 20.0, unit = "us" } }
[[model.mechanisms]]
id = "sensor.lag"
parameters = { time_constant = { value = 5.0, unit = "us" } }
[[model.mechanisms]]
id = "damping.nonlinear"
parameters = { coefficient = { value = 30.0, unit = "1/(um^2*s)" } }
"""


def late_model(folder: Path) -> Path:
    """The bundled model with a drive and a sensor that are late, and a damping that grows."""
    path = folder / "late.toml"
    path.write_text(MODEL.read_text(encoding="utf-8") + LATE, encoding="utf-8")
    return path


@pytest.mark.parametrize("late", [False, True])
def test_a_recorded_run_is_computed_to_the_bit(tmp_path: Path, late: bool) -> None:
    model = late_model(tmp_path) if late else MODEL
    recorded = run("me_amplitude", model=model, settings=SHORT, out=tmp_path / "run")
    assert recorded.signals["state"].max() == 2.0, "both loops act"
    export_c("me_amplitude", model=model, settings=SHORT, out=tmp_path / "loop")
    deviations = replayed_to_the_bit(tmp_path)
    assert deviations["estimate"]["max_percent"] < 0.02
    assert deviations["drive_frequency"]["max_Hz"] < 0.01


@pytest.mark.slow
def test_every_machine_that_is_here_computes_the_same(tmp_path: Path) -> None:
    run("me_amplitude", settings=SHORT, out=tmp_path / "run")
    export_c("me_amplitude", settings=SHORT, out=tmp_path / "loop")
    same_on_every_machine(tmp_path)


@pytest.mark.parametrize("precision", ["float", "double"])
def test_corners_are_computed_to_the_bit(tmp_path: Path, precision: str) -> None:
    model, settings = late_model(tmp_path), ["limits.rms=150 mA", "limits.rms_window=50 ms"]
    export_c("me_amplitude", model=model, settings=settings, out=tmp_path / "loop")
    scenario, _ = load_scenario(find_scenario("me_amplitude"), settings)
    oracle = corners_to_the_bit(tmp_path / "loop", law_of(scenario, read_resonator(model)), precision, 4000)
    assert {0, 1, 5} <= set(np.unique(oracle["fault"]).tolist())
    assert oracle["state"].max() == 2.0


def test_a_saturating_sensor_is_refused(tmp_path: Path) -> None:
    model = tmp_path / "saturating.toml"
    saturation = (
        '[[model.mechanisms]]\nid = "sensor.saturation"\n'
        'parameters = { curvature = { value = 0.5, unit = "1/um^2" } }\n'
    )
    model.write_text(MODEL.read_text(encoding="utf-8") + saturation, encoding="utf-8")
    with pytest.raises(InputError, match=r"sensor\.saturation of the model has no form in C"):
        export_c("me_amplitude", model=model, out=tmp_path / "loop")


def test_the_board_program_of_a_serial_line_has_one_command(tmp_path: Path) -> None:
    export_c("me_amplitude", out=tmp_path / "loop")
    assert not (tmp_path / "loop" / "boards" / "loop.c").exists()
    wire = {"driver.kind": "serial", "driver.port": "/nowhere"}
    with pytest.raises(InputError, match="one command and one reading; this device has 2 commands"):
        run_on_board("me_amplitude", board=tmp_path / "loop", settings=wire, out=tmp_path / "board")
