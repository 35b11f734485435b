"""Another model for a run that goes on: its estimator and controller follow the recorded rows, then take over.

The models lie in the run's folder, `model.toml` (number 0) and `retuned-N.toml`. The limits of the commands stay those
with which the run began: no model that was made while it lasts can widen them. Of a long run the last `HISTORY_S` are
followed; what the film has been through before them is handed on by the estimator that decided so far.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.hysteresis.film_memory import (
    Drifting,
    FilmMemory,
    load_memory,
    save_memory,
)
from rtctl.interfaces import Controller, Estimator
from rtctl.loop.compiled.step import compiled_step
from rtctl.loop.events import START, read_events
from rtctl.loop.step import Levels, ReadableStep, Step
from rtctl.loop.successor import Past, PastRows, Predecessor, Successor
from rtctl.plant_control.lookup import support_of
from rtctl.plant_control.support import Tuning
from rtctl.recording.tail import Tail
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import Scenario
from rtctl.session.run_folder import EVENTS, MODEL, SIGNALS
from rtctl.wiring import build_control, build_estimator

HISTORY_S = 20.0
FEW_ROWS = 10
"""Rows that the loop follows itself when another step takes over; those before are followed beside it."""
MOST_LOOKS = 1000
"""Looks after which rows that come faster than they are followed are left to the loop (in lockstep it can wait)."""
ROWS_AT_ONCE = 5
"""Rows that are followed before the interpreter is offered to the loop."""


def model_name(number: int) -> str:
    """Return the file of a run's model by its number."""
    return f"retuned-{number}.toml" if number else MODEL


def past_rows(table: Mapping[str, FloatArray], scenario: Scenario) -> PastRows:
    """Return columns of a recording as rows to follow."""
    profile = scenario.profile
    return PastRows(
        np.array(table["index"]),
        np.array(table["setpoint"]),
        np.stack([table[channel.name] for channel in profile.sensed], axis=1),
        np.stack([table[channel.name] for channel in profile.commands], axis=1),
    )


class Made(NamedTuple):
    """A step with a model's estimator and tuning, and its parts."""

    step: Step
    estimator: Estimator
    controller: Controller
    tuning: Tuning | None


def made_step(scenario: Scenario, model: Any, limits: tuple[CommandLimits, ...]) -> Made:
    """Return a step with a model's estimator and tuning. Raises InputError."""
    control = build_control(scenario, model)
    estimator = build_estimator(scenario, model)
    made = compiled_step(estimator, control.controller, limits)
    step = made or ReadableStep(estimator, control.controller, limits)
    return Made(step, estimator, control.controller, control.tuning)


def onset_name(number: int) -> str:
    """Return the file that says since when a model of a run is right."""
    return f"retuned-{number}.json"


def memory_name(number: int) -> str:
    """Return the file that says what the film had been through when a model of a run began to be right."""
    return f"retuned-{number}.npz"


class Onset(NamedTuple):
    """Since when a model of a run is right."""

    before: int
    """Number of the model that was right before."""
    until: int
    """Sample from which on the other one is."""
    memory: FilmMemory | None
    """What the film had been through some time before; None: it is not known."""
    at: int
    """Sample before which `memory` is right."""


def write_onset(folder: Path, number: int, onset: Onset) -> None:
    """Note since when model `number` is right."""
    if onset.memory is not None:
        save_memory(folder / memory_name(number), onset.memory)
    text = json.dumps({"before": onset.before, "until": onset.until, "memory_at": onset.at})
    (folder / onset_name(number)).write_text(text + "\n", encoding="utf-8")


def read_onset(folder: Path, number: int) -> Onset | None:
    """Return since when model `number` is right; None: nothing is known."""
    path, memory = folder / onset_name(number), folder / memory_name(number)
    if not path.is_file():
        return None
    found = json.loads(path.read_text(encoding="utf-8"))
    known = load_memory(memory) if memory.is_file() else None
    return Onset(int(found["before"]), int(found["until"]), known, int(found["memory_at"]))


def past_of(scenario: Scenario, model: Any, onset: Onset, heir: Estimator) -> Past | None:
    """Return the past of an estimator that can take over a memory; None where it cannot.

    Args:
        scenario: That of the run.
        model: The model that was right before.
        onset: Since when the heir's is.
        heir: The estimator.
    """
    before = build_estimator(scenario, model)
    if not isinstance(heir, Drifting) or not isinstance(before, Predecessor):
        return None
    return Past(onset.before, onset.until, before, heir, memory=onset.memory, at=onset.at)


def started(
    successor: Successor, since: int, start: Mapping[str, Any], first: int, rows: PastRows
) -> Successor:
    """Start a successor before sample `since`: from the run's start, or from the row itself where that is later.

    Args:
        successor: what follows.
        since: the sample.
        start: the values of the run's newest start, before sample `first`.
        first: see there.
        rows: begins with the row of `since`.
    """
    if since == first:
        successor.start(since, tuple(start["levels"]), tuple(start["sensed"]))
    else:
        levels: Levels = tuple(rows.commanded[0].tolist())
        successor.start(since, levels, tuple(rows.sensed[0].tolist()))
    return successor


class Successors:
    """Prepares steps for a run under way, in the thread that asks for them."""

    def __init__(
        self, folder: Path, scenario: Scenario, limits: tuple[CommandLimits, ...], setpoints: FloatArray
    ) -> None:
        """Remember a run.

        Args:
            folder: where it records.
            scenario: the checked scenario.
            limits: those of its commands, which stay.
            setpoints: the plan (n,) [controlled unit].
        """
        self._folder, self._scenario, self._limits, self._plan = folder, scenario, limits, setpoints
        self.made: tuple[Any, Controller] | None = None
        """Model and controller of the newest successor."""

    def prepare(self, number: int) -> tuple[Successor, str]:
        """Return what may take over with a model, almost up to the present sample, and how it was tuned.

        Raises:
            InputError: there is no such model, it is of another device, or it cannot be controlled within the margins.
        """
        scenario, path = self._scenario, self._folder / model_name(number)
        support = support_of(scenario.scenario.plant)
        if not path.is_file():
            raise InputError(f"{path}: missing; a model that is to take over lies in the run's folder")
        model = support.read_model(path)
        first_model = support.read_model(self._folder / MODEL)
        if support.identity(model) != support.identity(first_model):
            raise InputError(f"{path}: a model of another device than the run's")
        made = made_step(scenario, model, self._limits)
        period_s, delay = scenario.scenario.period_s, scenario.reading_delay
        successor = Successor(number, made.step, self._plan, period_s, delay)
        onset = read_onset(self._folder, number)
        if onset is not None:
            past = support.read_model(self._folder / model_name(onset.before))
            successor.past = past_of(scenario, past, onset, made.estimator)
        try:
            self._catch_up(successor, round(HISTORY_S / period_s))
        except OSError:
            raise InputError(f"{self._folder}: no run is under way here any more") from None
        self.made = model, made.controller
        return successor, made.tuning.describe() if made.tuning is not None else ""

    def _catch_up(self, successor: Successor, most: int) -> None:
        """Follow the recording until few rows are left."""
        tail = Tail(self._folder / SIGNALS)
        newest = [event for event in read_events(self._folder / EVENTS) if event.kind == START]
        whole = tail.look()
        if not newest or whole == 0:
            raise InputError(f"{self._folder}: the run has not begun yet")
        begin = max(whole - most, 0)
        rows = past_rows(tail.read(begin, whole), self._scenario)
        first = newest[-1].step
        rows = PastRows(*(column[rows.samples >= first] for column in rows))
        if not len(rows.samples):
            raise InputError(f"{self._folder}: the run has just started again; ask once more")
        started(successor, int(rows.samples[0]), newest[-1].values, first, rows)
        done = whole

        def newer() -> PastRows | None:
            nonlocal done
            last = tail.look()
            if last == done:
                return None
            found, done = past_rows(tail.read(done, last), self._scenario), last
            return found

        successor.newer = newer
        waiting: PastRows | None = rows
        for _ in range(MOST_LOOKS):
            if waiting is None:
                return
            for k in range(0, len(waiting.samples), ROWS_AT_ONCE):
                successor.follow(PastRows(*(column[k : k + ROWS_AT_ONCE] for column in waiting)))
                time.sleep(0.0)  # a loop in Python that has woken up goes first
            if len(waiting.samples) <= FEW_ROWS:
                return
            waiting = newer()
