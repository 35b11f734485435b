"""Replay of a recorded run through estimator, controller and limits.

The commands come out the same to the bit, or the first difference is reported. The recording gives what the loop could
not know (readings, which periods it reached); the events give where it started and what was changed while it ran; all
else is computed anew from the scenario and the model beside the recording.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import DriverError, InputError
from rtctl.loop.events import START, Event, read_events
from rtctl.loop.live_parameters import MODEL as MODEL_CHANGE
from rtctl.loop.live_parameters import SETPOINT
from rtctl.loop.step import Levels, Step, upcoming_setpoints
from rtctl.loop.successor import Successor, hand_on
from rtctl.plant_control.lookup import support_of
from rtctl.scenario.schema import Scenario, checked_scenario
from rtctl.session.closed_loop import planned_step
from rtctl.session.live.injected_faults import INJECTED
from rtctl.session.live.successors import (
    Onset,
    made_step,
    model_name,
    past_of,
    past_rows,
    read_onset,
    started,
)
from rtctl.session.run_folder import EVENTS, MODEL, is_interrupted, rows_left_by, scenario_tables
from rtctl.wiring import build_limits

ESTIMATE_COLUMNS = 4
"""Columns of an estimate: value, surrogate, standard error, status."""
BESIDE = ("doubt", INJECTED)
"""Kinds of events that the loop knew nothing of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """The first row that a replay computes differently."""

    index: int
    column: str
    recorded: float
    replayed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """The result of a replay."""

    rows: int
    first: Difference | None
    differing: Mapping[str, int]
    """Number of rows that differ in each column that differs anywhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded:
    """The contents of a run's folder."""

    scenario: Scenario
    model: Any
    signals: Mapping[str, FloatArray]
    events: tuple[Event, ...]
    further_models: Mapping[int, Any] = field(default_factory=dict)
    """Models that took over while it lasted, by their numbers; 0: the first one again."""
    onsets: Mapping[int, Onset] = field(default_factory=dict)
    """Since when each of them is right, as far as that is known."""


def read_run(folder: Path) -> Recorded:
    """Read a run that has ended or was killed. Raises InputError."""
    if is_interrupted(folder):
        rows, _ = rows_left_by(folder)
        signals, metadata, source = dict(rows.table()), rows.header.metadata, folder / "signals.rec"
    else:
        source = folder / "signals.parquet"
        signals, metadata = _parquet(source)
    scenario = checked_scenario(scenario_tables(metadata, source), str(source))
    model_file = folder / MODEL
    if not model_file.is_file():
        raise InputError(f"{model_file}: missing; a replay needs the model that the run used")
    support = support_of(scenario.scenario.plant)
    model = support.read_model(model_file)
    events = tuple(event for event in read_events(folder / EVENTS) if event.kind not in BESIDE)
    numbers = {int(event.values["number"]) for event in events if event.kind == MODEL_CHANGE}
    return Recorded(
        scenario=scenario,
        model=model,
        signals=signals,
        events=events,
        further_models={number: support.read_model(folder / model_name(number)) for number in numbers},
        onsets={number: onset for number in numbers if (onset := read_onset(folder, number)) is not None},
    )


def replay(run: Recorded) -> tuple[Replay, dict[str, FloatArray]]:
    """Compute a run again; return the comparison and the computed columns.

    Raises InputError if it is another scenario's.
    """
    step, setpoints, terms = planned_step(run.scenario, run.model)
    signals = run.signals
    names = _columns(run.scenario, signals, terms)
    replayed = {name: np.full(len(signals["index"]), np.nan) for name in names}
    for row, values in enumerate(_rows(run, step, setpoints)):
        for name, value in zip(names, values, strict=True):
            replayed[name][row] = value
    return _compared(signals, replayed), replayed


def _columns(scenario: Scenario, signals: Mapping[str, FloatArray], terms: Iterable[str]) -> list[str]:
    """Return the names of the columns that are computed again, in the order of the loop's rows."""
    names = list(signals)
    if names[:3] != ["index", "setpoint", "estimate"]:
        raise InputError(f"the recording begins with {', '.join(names[:3])}: not one of rtctl run")
    commands = [channel.name for channel in scenario.profile.commands]
    computed = ["setpoint", *names[2 : 2 + ESTIMATE_COLUMNS], *commands, *terms]
    if missing := [name for name in computed if name not in names]:
        raise InputError(f"the recording has no column {', '.join(missing)}: the scenario is of another run")
    return computed


def _rows(run: Recorded, step: Step, setpoints: FloatArray) -> Iterable[tuple[float, ...]]:
    """Yield the rows that the loop appended, without what was measured."""
    scenario, signals = run.scenario, run.signals
    period_s, delay = scenario.scenario.period_s, scenario.reading_delay
    sensed = np.stack([signals[channel.name] for channel in scenario.profile.sensed], axis=1).tolist()
    events = list(run.events)
    plan = setpoints.tolist()
    upcoming = upcoming_setpoints(setpoints, period_s, step.preview_s).tolist()
    chosen: float | None = None
    sent: deque[Levels] = deque(maxlen=delay + 1)
    levels: Levels = ()
    previous, started_at = -1, 0
    for row, index in enumerate(signals["index"].astype(np.int64).tolist()):
        while events and events[0].step <= index:
            event = events.pop(0)
            if event.kind == START:
                applied = tuple(event.values["levels"])
                sent.extend((delay + 1) * [applied])
                first_setpoint = plan[event.step] if chosen is None else chosen
                levels = step.start(applied, first_setpoint, event.values["sensed"], period_s)
                previous, started_at = event.step - 1, event.step
            elif event.kind == "change" and event.values["name"] == SETPOINT:
                value = event.values["value"]
                chosen = None if value != value else value
            elif event.kind == "change":
                step.change(event.values["name"], event.values["value"])
            elif event.kind == MODEL_CHANGE:
                successor = _succeeding(run, event, setpoints, levels)
                if not successor.knows_all(started_at):
                    hand_on(step, successor.step)
                step, upcoming = successor.step, successor.upcoming.tolist()
        if not levels:
            raise InputError(f"{EVENTS} does not say where the run started before sample {index}")
        setpoint, aimed = (plan[index], upcoming[index]) if chosen is None else (chosen, chosen)
        sent.append(levels)
        commanded = levels
        try:
            estimate, levels, terms = step.step(
                setpoint, aimed, sent[0], levels, sensed[row], (index - previous) * period_s
            )
        except DriverError as error:
            raise InputError(
                f"sample {index}: {error}: the run got past it, so this is another model"
            ) from None
        yield (setpoint, *estimate, *commanded, *terms)
        previous = index


def _succeeding(run: Recorded, event: Event, setpoints: FloatArray, levels: Levels) -> Successor:
    """Return what took over before sample `event.step`, after it has followed the recorded rows as it did then."""
    number, since = int(event.values["number"]), int(event.values["since"])
    if number not in run.further_models:
        raise InputError(f"{model_name(number)}: missing, which took over before sample {event.step}")
    scenario = run.scenario
    made = made_step(scenario, run.further_models[number], build_limits(scenario, run.model))
    successor = Successor(number, made.step, setpoints, scenario.scenario.period_s, scenario.reading_delay)
    if "until" in event.values:
        before, until = int(event.values["before"]), int(event.values["until"])
        past = run.further_models[before] if before else run.model
        onset = run.onsets.get(number, Onset(before, until, None, -1))._replace(before=before, until=until)
        successor.past = past_of(scenario, past, onset, made.estimator)
    index = run.signals["index"]
    within = slice(int(np.searchsorted(index, since)), int(np.searchsorted(index, event.step)))
    rows = past_rows({name: column[within] for name, column in run.signals.items()}, scenario)
    start = [one for one in run.events if one.kind == START and one.step <= since][-1]
    started(successor, since, start.values, start.step, rows)
    successor.follow(rows)
    successor.take_over(levels)
    return successor


def _compared(signals: Mapping[str, FloatArray], replayed: Mapping[str, FloatArray]) -> Replay:
    """Compare recorded and replayed columns bit by bit; a NaN equals a NaN."""
    differing: dict[str, int] = {}
    first: Difference | None = None
    for name, values in replayed.items():
        recorded = signals[name]
        unequal = (recorded.view(np.uint64) != values.view(np.uint64)) & ~(
            np.isnan(recorded) & np.isnan(values)
        )
        if not unequal.any():
            continue
        differing[name] = int(unequal.sum())
        row = int(np.argmax(unequal))
        index = int(signals["index"][row])
        if first is None or index < first.index:
            first = Difference(
                index=index, column=name, recorded=float(recorded[row]), replayed=float(values[row])
            )
    return Replay(rows=len(signals["index"]), first=first, differing=differing)


def _parquet(path: Path) -> tuple[dict[str, FloatArray], dict[str, str]]:
    import pyarrow.parquet as pq

    if not path.is_file():
        raise InputError(
            f"{path}: missing; the folder of a run that has ended is needed (rtctl run ... --out DIR)"
        )
    table = pq.read_table(path)
    signals = {name: table[name].to_numpy().astype(np.float64) for name in table.column_names}
    metadata = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
    return signals, metadata


def summary_of(result: Replay, folder: Path) -> dict[str, Any]:
    """Return the result for `--json`."""
    first = result.first
    return {
        "run": str(folder),
        "rows": result.rows,
        "identical": first is None,
        "first_difference": None if first is None else asdict(first),
        "differing_rows": dict(result.differing),
    }
