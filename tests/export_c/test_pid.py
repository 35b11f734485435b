"""An exported PID on a reading of the controlled output against the loop in Python, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.api.exporting.c import export_c, replay_export
from rtctl.api.runs.running import run
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.comparison import differences, prove
from rtctl.export.c.proof.corners import corner_rows
from rtctl.export.c.proof.in_python import PythonLaw
from rtctl.export.c.proof.machines import MACHINES, REALS, build
from rtctl.export.c.proof.machines import run as run_on
from rtctl.export.c.translated import translated
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
    proof = prove(tmp_path / "loop", tmp_path / "run", ["gcc"])
    assert [(one.machine, one.precision, one.first) for one in proof.computed] == [
        ("this computer, gcc", "float", ""),
        ("the recorded loop", "double", ""),
        ("this computer, gcc", "double", ""),
    ]
    assert proof.deviations["estimate"]["max_percent"] < 1e-4
    assert proof.deviations["command"]["max_N"] < 1e-4


@pytest.mark.slow
def test_every_machine_that_is_here_computes_the_same(tmp_path: Path) -> None:
    tables = scenario_of(tmp_path)
    run(tables, out=tmp_path / "run")
    export_c(tables, out=tmp_path / "loop")
    computed = [one for one in replay_export(tmp_path / "run", tmp_path / "loop").computed if not one.skipped]
    assert [one.first for one in computed] == [""] * len(computed)


@pytest.mark.parametrize("precision", ["float", "double"])
def test_corners_are_computed_to_the_bit(tmp_path: Path, precision: str) -> None:
    tables = scenario_of(tmp_path)
    made = export_c(tables, out=tmp_path / "loop")
    assert made.estimator == "none"
    scenario = checked_scenario(tables, "stage")
    exported = translated(law_of(scenario, model_of(scenario)))
    rows = corner_rows(exported.law, 4000, REALS[precision], seed=2)
    oracle = PythonLaw(*exported, REALS[precision])(rows)
    assert {0, 1} <= set(np.unique(oracle["fault"]).tolist())
    machine = MACHINES["gcc"]
    found = run_on(build(tmp_path / "loop", machine, precision), machine, rows, oracle.dtype)
    assert differences(found, oracle) == (0, "")


def model_of(scenario: Any) -> Any:
    """The model that a scenario names."""
    from rtctl.wiring import model_of as read

    return read(scenario, Path(), None)
