"""Recovery of a killed run: its recordings made into Parquet, summary and picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import Fault, InputError
from rtctl.evaluation.summary import summarise
from rtctl.loop.events import read_events
from rtctl.loop.supervisor import LoopOutcome
from rtctl.plant_control.lookup import support_of
from rtctl.scenario.schema import checked_scenario
from rtctl.session.run_files import RunResult, write_run
from rtctl.session.run_folder import EVENTS, MODEL, SIGNALS, rows_left_by, scenario_tables
from rtctl.timing.step_timing import StepTiming


def recover(folder: Path) -> dict[str, Any]:
    """Write the files of the killed run in `folder`; return its summary, with verdict "fault", named "killed".

    Raises:
        InputError: there is no recording, it is empty, or its model is missing.
    """
    signals, timing = rows_left_by(folder)
    tables = scenario_tables(signals.header.metadata, folder / SIGNALS)
    scenario = checked_scenario(tables, str(folder / SIGNALS))
    if not (folder / MODEL).is_file():
        raise InputError(f"{folder / MODEL}: missing; the summary needs the model that the run used")
    plant = support_of(scenario.scenario.plant)
    model = plant.read_model(folder / MODEL)
    table = signals.table()
    index = table["index"]
    times = _timing(timing.table(), steps=len(index), overruns=int(index[-1]) + 1 - len(index))
    outcome = LoopOutcome(
        steps=len(index),
        overruns=times.overruns,
        fault=Fault.KILLED,
        message=f"the process ended without a word after sample {int(index[-1])}; recovered by rtctl recover",
    )
    summary = summarise(scenario, plant, model, outcome, table, times)
    units = dict(signals.header.columns)
    events = read_events(folder / EVENTS) if (folder / EVENTS).is_file() else ()
    result = RunResult(
        summary=summary, signals=table, units=units, timing=timing.table(), tuning=None,
        changes=tuple(event for event in events if event.kind == "change"),
    )  # fmt: skip
    write_run(folder, scenario, tables, result)
    return summary


def _timing(table: Mapping[str, FloatArray], *, steps: int, overruns: int) -> StepTiming:
    """Return the histograms of the recorded times [us]; those of the last of `steps` may be missing after a kill."""
    timing = StepTiming()
    columns = [np.round(1e3 * table[name]).astype(np.int64).tolist() for name in table]
    for lateness_ns, round_trip_ns, compute_ns in zip(*columns, strict=True):
        timing.step(lateness_ns, round_trip_ns, compute_ns)
    timing.steps, timing.overruns = steps, overruns
    return timing
