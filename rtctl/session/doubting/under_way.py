"""Doubting a run under way: its newest rows through the watch, findings among its events, a policy at work."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.doubt.belief import MemoryBefore
from rtctl.doubt.watch import Finding
from rtctl.loop.events import read_events
from rtctl.plant_control.lookup import support_of
from rtctl.recording.tail import MOST_ROWS, Tail
from rtctl.scenario.schema import Scenario, checked_scenario
from rtctl.session.doubting.recorded import Doubted, FedWatch, as_json
from rtctl.session.run_folder import EVENTS, MODEL, SIGNALS, scenario_tables

LOOK_EVERY_S = 0.2
DOUBT = "doubt"
"""Kind of the events that are noted."""


class Acting(Protocol):
    """A policy at work on a run."""

    def act(self, finding: Finding) -> str:
        """Return what is done about a finding, in words; "": nothing."""
        ...

    def see(self, table: Mapping[str, FloatArray]) -> Iterator[Finding]:
        """Take the newest rows; yield what came of what was done."""
        ...


MakePolicy = Callable[[Scenario, Any, MemoryBefore], Acting]
"""Returns what is done about findings of a run of a scenario with a model; the last argument tells what the plant has
been through."""


class LiveWatch:
    """Follows the recording of a run under way."""

    def __init__(
        self,
        folder: Path,
        policy: MakePolicy,
        say: Callable[[Finding, str], None],
        *,
        use_reference: bool = True,
    ) -> None:
        """Open a recording.

        Args:
            folder: the folder into which the run records.
            policy: returns what is done about findings.
            say: hears each finding, and what was done.
            use_reference: whether the reference instrument is used.

        Raises:
            InputError: its model or kind of plant cannot be doubted, or not by this policy.
        """
        path = folder / SIGNALS
        self.tail = Tail(path)
        try:
            scenario = checked_scenario(scenario_tables(self.tail.header.metadata, path), str(path))
            model = support_of(scenario.scenario.plant).read_model(folder / MODEL)
            self._fed = FedWatch(scenario, model, use_reference=use_reference)
            self._acting = policy(scenario, model, self._fed.memory_before)
        except BaseException:
            self.tail.close()
            raise
        self._folder, self._say, self._read = folder, say, 0
        self.findings: list[Finding] = []

    def look(self) -> None:
        """Take the rows that are new."""
        whole = self.tail.look()
        self._fed.know(read_events(self._folder / EVENTS))
        while self._read < whole:
            upto = min(whole, self._read + MOST_ROWS)
            table = self.tail.read(self._read, upto)
            self._read = upto
            for finding in self._acting.see(table):
                self._hear(finding)
            for finding in self._fed.feed(table):
                self._hear(finding)

    def finish(self) -> Doubted:
        """End the watch; return what it has found."""
        for finding in self._fed.watch.finish():
            self._hear(finding)
        return Doubted(self.findings, self._fed.watch, self._fed.reader.period_s)

    def _hear(self, finding: Finding) -> None:
        self.findings.append(finding)
        done = self._acting.act(finding)
        note(self._folder, finding, done)
        self._say(finding, done)


def doubt_live(
    folder: Path,
    policy: MakePolicy,
    say: Callable[[Finding, str], None],
    is_recording: Callable[[Path], bool],
    stop_requested: Callable[[], bool],
    *,
    use_reference: bool = True,
) -> Doubted:
    """Doubt a run under way until it ends; note findings among its events.

    Args:
        folder: the folder into which it records.
        policy: returns what is done about findings.
        say: hears each finding, and what was done.
        is_recording: whether a recording is still being written.
        stop_requested: whether the watch is to end.
        use_reference: whether the reference instrument is used.

    Raises:
        InputError: nothing is being recorded there, or its model or kind of plant cannot be doubted.
    """
    path = folder / SIGNALS
    if not path.is_file() or not is_recording(path):
        raise InputError(
            f"{folder}: no run is under way here; rtctl doubt {folder} doubts one that has ended"
        )
    watch = LiveWatch(folder, policy, say, use_reference=use_reference)
    try:
        while not stop_requested():
            lasts = is_recording(path) and not watch.tail.replaced()
            watch.look()
            if not lasts:
                break
            time.sleep(LOOK_EVERY_S)
        return watch.finish()
    finally:
        watch.tail.close()


def note(folder: Path, finding: Finding, done: str) -> None:
    """Append a finding to the run's events: one write of one line, which does not mix with those of the loop."""
    line = {"step": finding.sample, "event": DOUBT, **as_json(finding)} | ({"done": done} if done else {})
    number = os.open(folder / EVENTS, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        os.write(number, json.dumps(line).encode() + b"\n")
    finally:
        os.close(number)
