"""Panels and planes come from names, roles and units: every bundled scenario and records of any dataset have theirs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rtctl.controllers.playback import PlaybackController
from rtctl.estimators.none import NoEstimator
from rtctl.live_page.shown.event_log import EventLog
from rtctl.live_page.shown.panels import panels_of, planes_of
from rtctl.live_page.shown.signals import NOT_DRAWN, PLAYED_TERMS, signals_of
from rtctl.live_page.shown.state import verdict_of
from rtctl.loop.supervisor import signal_columns
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.schema import load_scenario


@pytest.mark.parametrize("name", sorted(path.stem for path in bundled_scenarios().glob("*.toml")))
def test_a_panel_shows_each_signal_of_a_bundled_scenario(name: str) -> None:
    scenario, _ = load_scenario(bundled_scenarios() / f"{name}.toml", [])
    profile = scenario.profile
    columns = signal_columns(profile, NoEstimator(), PlaybackController("1"))
    shown = signals_of(columns, scenario)
    drawn = {number for panel in panels_of(shown) for number in panel["signals"]}
    assert drawn == set(range(len(shown.signals)))
    for panel in panels_of(shown):
        assert {shown.signals[number].unit for number in panel["signals"]} == {panel["unit"]}
    titles = {panel["title"] for panel in panels_of(shown)}
    assert ("Terms of the controller" in titles) == (scenario.reference is not None), (
        "a played command has none"
    )
    names = {signal.name for signal in shown.signals}
    hidden = (
        NOT_DRAWN
        | {"estimate_standard_error"}
        | (set() if scenario.reference else {"setpoint", *PLAYED_TERMS})
    )
    assert {column for column, _ in columns} - names == hidden
    planes = [
        (shown.signals[plane["x"]].name, shown.signals[plane["y"][0]].name) for plane in planes_of(shown, {})
    ]
    assert planes[0] == (profile.commands[-1].name, profile.sensed[0].name)
    assert planes[1] == (profile.commands[-1].name, profile.reference.name)
    assert ("setpoint" in names) == (scenario.reference is not None)


def test_errors_and_band_are_computed_from_the_columns() -> None:
    scenario, _ = load_scenario(bundled_scenarios() / "steps.toml", [])
    columns = signal_columns(scenario.profile, NoEstimator(), PlaybackController("mA"))
    table = {name: np.zeros(2) for name, _ in columns}
    table |= {
        "setpoint": np.array([30.0, 30.0]), "estimate": np.array([29.0, 28.0]),
        "deflection": np.array([29.5, np.nan]), "estimate_standard_error": np.array([0.25, 0.5]),
    }  # fmt: skip
    shown = signals_of(columns, scenario)
    values = dict(zip([signal.name for signal in shown.signals], shown.matrix(table).tolist(), strict=True))
    assert values["tracking error"] == [0.5, 2.0], "against the estimate where no instrument reads"
    assert values["self-sensing error"][0] == -0.5
    assert values["estimate − 2 standard errors"] == [28.5, 27.0]
    assert values["estimate + 2 standard errors"] == [29.5, 29.0]


def test_columns_of_which_nothing_is_known_have_a_panel_for_each_unit() -> None:
    shown = signals_of([("index", ""), ("force", "N"), ("gap", "mm"), ("limit", "N")], None)
    assert [(panel["unit"], panel["signals"]) for panel in panels_of(shown)] == [("N", [0, 2]), ("mm", [1])]
    planes = planes_of(shown, {"inputs": '["force"]'})
    assert planes == [{"x": 0, "y": [1]}, {"x": 0, "y": [2]}]


def test_units_of_events_and_verdict_are_printed_as_those_of_the_charts(tmp_path: Path) -> None:
    scenario, _ = load_scenario(bundled_scenarios() / "steps.toml", [])
    changes = [
        {"step": 5, "event": "change", "name": name, "value": 4.0} for name in ("setpoint", "controller.ki")
    ]
    (tmp_path / "events.jsonl").write_text(
        "".join(f"{json.dumps(one)}\n" for one in changes), encoding="utf-8"
    )
    events = EventLog(tmp_path, scenario, 1e-3).look()
    assert events is not None
    assert [one["text"] for one in events] == ["setpoint 4 µm", "controller.ki 4 mA/(µm·s)"]
    errors = {"mean_abs_um": 2.5, "max_abs_um": 28.6}
    summary = {
        "verdict": "pass", "tracking": errors, "self_sensing": {}, "checks": [], "timing": {"overruns": 0},
    }  # fmt: skip
    (tmp_path / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    found = verdict_of(tmp_path)
    assert found is not None
    assert found["lines"] == ["tracking error: mean 2.5 µm, largest 28.6 µm"]
