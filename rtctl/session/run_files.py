"""The files of a run that has ended: `summary.json`, `signals.parquet`, `timing.parquet` and `run.png`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import plain_unit
from rtctl.border.records import Mark
from rtctl.evaluation.metrics import write_json
from rtctl.evaluation.summary import range_of
from rtctl.extras import can_draw
from rtctl.loop.events import Event
from rtctl.loop.live_parameters import units_of_parameters
from rtctl.output.own_files import refuse_foreign
from rtctl.output.readable_units import readable
from rtctl.plant_control.support import Tuning
from rtctl.scenario.schema import Scenario
from rtctl.session.run_folder import run_metadata, write_tables


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """The results of a run."""

    summary: dict[str, Any]
    """The content of `summary.json`."""
    signals: Mapping[str, FloatArray]
    """The recorded signals (n,) by name."""
    units: Mapping[str, str]
    """The unit of each signal."""
    timing: Mapping[str, FloatArray]
    """Lateness, round trip and compute time of each sample (n,) [us]."""
    tuning: Tuning | None
    """How the controller was tuned; None: it was given, or there is none."""
    changes: tuple[Event, ...] = ()
    """What was changed while it ran."""


def write_run(
    folder: Path, scenario: Scenario, tables: Mapping[str, Any], result: RunResult, *, plot: bool = True
) -> None:
    """Write all files of a run; the summary after the recordings, so that a folder with a summary has them whole.

    Args:
        folder: the folder of the run.
        scenario: the checked scenario.
        tables: the scenario as it was run, overrides included; it goes into the recording's metadata.
        result: the results.
        plot: whether to draw the run.
    """
    refuse_foreign(folder / "summary.json", "run")
    (folder / "summary.json").unlink(missing_ok=True)  # of an earlier run in the same folder
    write_tables(folder, result.signals, result.timing, result.units, run_metadata(tables))
    write_json(folder / "summary.json", result.summary, "run")
    if plot and len(result.signals["index"]) > 1:  # last: a picture takes longest, and nothing depends on it
        draw_run(folder / "run.png", scenario, result)


def draw_run(path: Path, scenario: Scenario, result: RunResult) -> None:
    """Draw setpoint, estimate, reference and command of a run into a PNG file at `path`."""
    if not can_draw():
        return
    from rtctl.plots import plot_run

    plot_run(
        path,
        scenario.scenario.period_s * result.signals["index"],
        result.signals,
        title=scenario.scenario.title,
        closed_loop=scenario.reference is not None,
        output_range=range_of(result.summary, scenario.profile.reference.unit),
        profile=scenario.profile,
        marks=marks_of(scenario, result.changes),
    )


def marks_of(scenario: Scenario, changes: Sequence[Event]) -> list[Mark]:
    """Return changes as a picture marks them: time [s] and text with the parameter's unit."""
    period_s = scenario.scenario.period_s
    units = units_of_parameters(scenario.profile, is_played=scenario.reference is None)
    return [Mark(period_s * one.step, _in_words(one.values, units)) for one in changes]


def _in_words(values: Mapping[str, Any], units: Mapping[str, str]) -> str:
    """Return `setpoint 30 um`, `setpoint: plan` or `controller.kp 0.02 mA/um`."""
    name, value = str(values["name"]), float(values["value"])
    return f"{name}: plan" if value != value else f"{name} {readable(value, plain_unit(units.get(name, '')))}"
