"""An exported PID on a reading of the controlled output against the loop in Python, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from export_cases import corners_to_the_bit, replayed_to_the_bit, same_on_every_machine

from rtctl.api.exporting.c import export_c
from rtctl.api.runs.running import run
from rtctl.export.c.laws.planning import law_of
from rtctl.scenario.schema import checked_scenario

STAGE = """
[model]
kind = "equations"
[model.inputs]
force = { unit = "N" }
[model.states]
z = { unit = "mm", rate = "v" }
v = { unit = "mm/s", rate = "(force - k*z - c*v)/m" }
[model.outputs]
place = { unit = "um", value = "z" }
shown = { unit = "mm", value = "z" }
[model.parameters]
k = { value = 900.0, unit = "N/m" }
c = { value = 6.0, unit = "N*s/m" }
m = { value = 10.0, unit = "g" }
[device]
reference = "shown"
[device.inputs.force]
low = -2.0
high = 2.0
[device.outputs.place]
noise = 0.2
[device.outputs.shown]
sensed = false
low = -1.5
high = 1.5
"""


def scenario_of(folder: Path, **tables: Any) -> dict[str, Any]:
    """A stage whose place is read, with a PID by hand."""
    model = folder / "stage.toml"
    model.write_text(STAGE, encoding="utf-8")
    return {
        "scenario": {
            "title": "stage", "plant": "equations", "model": str(model), "period": "2 ms", "duration": "0.6 s",
        },
        "driver": {"kind": "inprocess", "device": str(model), "seed": 3},
        "limits": {
            "low": "-1 N", "high": "0.8 N", "safe": "0 N", "slew": "150 N/s", "sensed_low": "-2 mm",
            "sensed_high": "2 mm",
        },
        "reference": {"kind": "steps", "levels": ["0 mm", "1 mm", "-0.3 mm"], "hold": "200 ms"},
        "estimator": {"kind": "none"},
        "controller": {
            "kind": "pid", "kp": "0.4 N/mm", "ki": "40 N/mm/s", "kd": "0.004 N/mm*s", "setpoint_weight": 0.5,
        },
        **tables,
    }  # fmt: skip


def test_a_recorded_run_is_computed_to_the_bit(tmp_path: Path) -> None:
    tables = scenario_of(tmp_path)
    recorded = run(tables, out=tmp_path / "run")
    assert recorded.signals["force"].max() == 0.8, "the limit lets less through than is asked for"
    assert np.abs(recorded.signals["derivative"]).max() > 0.0
    export_c(tables, out=tmp_path / "loop")
    deviations = replayed_to_the_bit(tmp_path)
    assert deviations["estimate"]["max_percent"] < 1e-4
    assert deviations["command"]["max_N"] < 1e-4


@pytest.mark.slow
def test_every_machine_that_is_here_computes_the_same(tmp_path: Path) -> None:
    tables = scenario_of(tmp_path)
    run(tables, out=tmp_path / "run")
    export_c(tables, out=tmp_path / "loop")
    same_on_every_machine(tmp_path)


@pytest.mark.parametrize("precision", ["float", "double"])
def test_corners_are_computed_to_the_bit(tmp_path: Path, precision: str) -> None:
    tables = scenario_of(tmp_path)
    made = export_c(tables, out=tmp_path / "loop")
    assert made.estimator == "none"
    scenario = checked_scenario(tables, "stage")
    corners_to_the_bit(tmp_path / "loop", law_of(scenario, model_of(scenario)), precision, 4000)


def model_of(scenario: Any) -> Any:
    """The model that a scenario names."""
    from rtctl.wiring import model_of as read

    return read(scenario, Path(), None)
