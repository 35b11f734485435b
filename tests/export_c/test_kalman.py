"""The exported Kalman filter of a user's equations against the loop in Python, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from export_cases import corners_to_the_bit, replayed_to_the_bit, same_on_every_machine
from wire_cases import served_process

from rtctl.api.exporting.c import export_c, run_on_board
from rtctl.api.runs.running import run
from rtctl.border.errors import InputError
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.machines import MACHINES, missing
from rtctl.scenario.schema import checked_scenario
from rtctl.wiring import model_of

OVEN = """
[model]
kind = "equations"
[model.inputs]
power = { unit = "W" }
[model.states]
core = { unit = "K", rate = "(power - loss*(core - room))/capacity", initial = 300.0, low = 290.0 }
shell = { unit = "K", rate = "(core - shell)/slow*where(core > room + span/2, 2, 1)", initial = 300.0 }
[model.outputs]
film = { unit = "ohm", value = "cold*exp(-(shell - room)/width) + bend*abs(sin((shell - room)/width))" }
bow = { unit = "um", value = "reach*tanh((max(core - room, 0*room)/span)^1.5)" }
[model.parameters]
loss     = { value = 2.0,  unit = "mW/K" }
capacity = { value = 1.0,  unit = "mJ/K" }
slow     = { value = 0.2,  unit = "s" }
cold     = { value = 2.0,  unit = "kohm" }
bend     = { value = 20.0, unit = "ohm" }
room     = { value = 300.0, unit = "K" }
width    = { value = 30.0, unit = "K" }
span     = { value = 30.0, unit = "K" }
reach    = { value = 60.0, unit = "um" }
[device]
reference = "bow"
[device.inputs.power]
low = 0.0
high = 0.1
[device.outputs.film]
noise = 1.0
[device.outputs.bow]
sensed = false
low = 0.0
high = 50.0
"""
"""A film beside a heated core: one resistance tells two temperatures, of which one makes the deflection."""
CLASS = """
class Heated:
    inputs = {"power": "W"}
    states = {"rise": {"unit": "K", "initial": 0.0}}
    outputs = {"film": "K"}
    parameters = {"gain": {"value": 50.0, "unit": "K/W"}, "slow": {"value": 0.5, "unit": "s"}}
    device = {"outputs": {"film": {"noise": 0.01, "low": 0.0, "high": 100.0}}}

    def rates(rise, power, gain, slow):
        return (gain * power - rise) / slow

    def readings(rise):
        return rise
"""
COIL = Path(__file__).resolve().parents[2] / "scenarios" / "models" / "equations" / "voice_coil.toml"


def scenario_of(folder: Path, text: str = OVEN, **tables: Any) -> dict[str, Any]:
    model = folder / "oven.toml"
    model.write_text(text, encoding="utf-8")
    return {
        "scenario": {
            "title": "oven", "plant": "equations", "model": str(model), "period": "10 ms", "duration": "3 s",
        },
        "driver": {"kind": "inprocess", "device": str(model), "seed": 3},
        "limits": {
            "low": "0 W", "high": "0.08 W", "safe": "0.01 W", "sensed_low": "10 ohm", "sensed_high": "5 kohm",
        },
        "reference": {"kind": "steps", "levels": ["15 um", "35 um", "20 um"], "hold": "1 s"},
        "estimator": {"kind": "kalman"},
        "controller": {"kind": "pid"},
        **tables,
    }  # fmt: skip


def test_a_recorded_run_is_computed_to_the_bit(tmp_path: Path) -> None:
    tables = scenario_of(tmp_path)
    recorded = run(tables, out=tmp_path / "run")
    apart = np.abs(recorded.signals["estimate"] - recorded.signals["bow"])
    assert apart[50:].max() < 2.0, "the filter estimates"
    export_c(tables, out=tmp_path / "loop")
    deviations = replayed_to_the_bit(tmp_path)
    assert deviations["estimate"]["max_percent"] < 0.01


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
    assert made.estimator == "kalman"
    scenario = checked_scenario(tables, "oven")
    oracle = corners_to_the_bit(
        tmp_path / "loop", law_of(scenario, model_of(scenario, Path(), None)), precision, 2000
    )
    assert 16 in oracle["estimate_status"], "some reading disagrees with the equations"


@pytest.mark.slow
@pytest.mark.wire
@pytest.mark.skipif(bool(missing(MACHINES["m4f"])), reason=missing(MACHINES["m4f"]))
def test_a_board_positions_a_coil_by_its_current(tmp_path: Path) -> None:
    changes = {
        "reference.levels": ["0 mm", "1.5 mm"],
        "reference.hold": "60 ms",
        "scenario.duration": "120 ms",
    }
    export_c("voice_coil_steps", settings=changes, out=tmp_path / "loop")
    with served_process(str(COIL), "serial", tmp_path, seed=3) as device:
        assigned = dict(word.split("=", 1) for word in device.settings[1::2])
        there = run_on_board(
            "voice_coil_steps",
            board=tmp_path / "loop",
            settings={**changes, **assigned},
            out=tmp_path / "board",
        )
    assert not there.summary["faults"]
    assert there.fault is None
    assert there.folder == tmp_path / "board"
    assert len(there.time_s) == there.summary["timing"]["steps"]
    place, estimate = (np.asarray(there.signals[name]) for name in ("x", "estimate"))
    assert np.abs(estimate - place).max() < 0.06  # mm of 6, as of the loop in Python
    assert abs(place[-10] - 1.5) < 0.01


def test_events_have_no_form(tmp_path: Path) -> None:
    event = '[model.events.hot]\nwhen = "core - 2*room"\nset = { core = "room" }\n[device]\n'
    with pytest.raises(InputError, match="equations with events has no form in C"):
        export_c(scenario_of(tmp_path, OVEN.replace("[device]\n", event)), out=tmp_path / "loop")


def test_a_class_of_the_user_has_no_form(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "heated.py").write_text(CLASS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    model = '[model]\nkind = "equations"\npython = "heated:Heated"\n'
    limits = {"low": "0 W", "high": "1 W", "sensed_low": "-1 K", "sensed_high": "500 K"}
    reference = {"kind": "steps", "levels": ["20 K"], "hold": "3 s"}
    with pytest.raises(InputError, match="functions of a Python class has no form in C"):
        export_c(scenario_of(tmp_path, model, limits=limits, reference=reference), out=tmp_path / "loop")
