"""Doubting a run that has ended: rows from its folder through `rtctl.doubt.watch`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.doubt.belief import Belief, Rows
from rtctl.doubt.watch import Finding, Watch
from rtctl.evaluation.metrics import write_json
from rtctl.loop.events import START, Event
from rtctl.recording.tail import MOST_ROWS
from rtctl.registry import plant_kind
from rtctl.scenario.schema import Scenario
from rtctl.session.replay import read_run


class Doubted(NamedTuple):
    """What the watch of a run has found."""

    findings: list[Finding]
    watch: Watch
    period_s: float


class RowReader:
    """Columns of a recording to rows of the watch; keeps the levels that are on their way, and the last sample."""

    def __init__(self, scenario: Scenario, *, use_reference: bool) -> None:
        profile = scenario.profile
        self._names = (profile.commands[0].name, profile.sensed[0].name, profile.reference.name)
        self.period_s = scenario.scenario.period_s
        self._delay, self._use = scenario.reading_delay, use_reference
        self._sent: list[float] = []
        self._previous = -1.0

    def start(self, level: float, first: int) -> None:
        """Begin at an applied level [the command's unit] before sample `first`."""
        self._sent, self._previous = self._delay * [level], first - 1.0

    def rows(self, table: Mapping[str, FloatArray]) -> Rows:
        """Return the rows of a part of the recording."""
        command, sensed, reference = self._names
        index = np.array(table["index"])
        sent = np.concatenate([self._sent, table[command]])
        levels, self._sent = sent[: len(index)], sent[len(index) :].tolist()
        elapsed_s = np.diff(index, prepend=self._previous) * self.period_s
        self._previous = float(index[-1]) if len(index) else self._previous
        read = np.array(table[reference]) if self._use else np.full(len(index), np.nan)
        return Rows(index, levels, elapsed_s, np.array(table[sensed]), read, np.array(table["estimate"]))


def belief_of(scenario: Scenario, model: Any) -> Belief:
    """Return the free run of a model. Raises InputError for a kind of plant that has none, and for open loops."""
    kind = plant_kind(scenario.scenario.plant)
    if kind.belief is None:
        raise InputError(
            f'a "{kind.name}" run cannot be doubted yet: no free run of such models over a recording is known'
        )
    belief: Belief = kind.part(kind.belief)(model)
    return belief


class FedWatch:
    """Feeds rows and starts of a run into a watch."""

    def __init__(self, scenario: Scenario, model: Any, *, use_reference: bool) -> None:
        self.reader = RowReader(scenario, use_reference=use_reference)
        belief = belief_of(scenario, model)
        self.watch, self.memory_before = Watch(belief, self.reader.period_s), belief.memory_before
        self._starts: list[Event] = []
        self._taken = 0

    def know(self, events: Iterator[Event]) -> None:
        """Take note of the starts of the run."""
        self._starts = [event for event in events if event.kind == START]

    def feed(self, table: Mapping[str, FloatArray]) -> Iterator[Finding]:
        """Take a part of the recording; yield what there is to say."""
        index = np.array(table["index"])
        ends = [
            event.step
            for event in self._starts[self._taken :]
            if event.step <= (index[-1] if len(index) else -1)
        ]
        at = 0
        for step in [*ends, None]:
            upto = len(index) if step is None else int(np.searchsorted(index, step))
            if upto > at:
                yield from self.watch.feed(self.reader.rows({name: table[name][at:upto] for name in table}))
            at = upto
            if step is not None:
                level = float(self._starts[self._taken].values["levels"][0])
                self.reader.start(level, step)
                self.watch.restart(level)
                self._taken += 1


def doubt_run(folder: Path, *, use_reference: bool = True) -> Doubted:
    """Doubt a run that has ended or was killed. Raises InputError."""
    recorded = read_run(folder)
    fed = FedWatch(recorded.scenario, recorded.model, use_reference=use_reference)
    fed.know(iter(recorded.events))
    signals = recorded.signals
    findings: list[Finding] = []
    for begin in range(0, len(signals["index"]), MOST_ROWS):
        part = {name: signals[name][begin : begin + MOST_ROWS] for name in signals}
        findings += fed.feed(part)
    findings += fed.watch.finish()
    return Doubted(findings, fed.watch, fed.reader.period_s)


def as_json(finding: Finding) -> dict[str, Any]:
    """Return a finding for `doubt.json` and the events."""
    causes = [
        {name: value for name, value in one._asdict().items() if value == value} for one in finding.causes
    ]
    return {
        "kind": finding.kind, "sample": finding.sample, "since": finding.since, "message": finding.message,
    } | ({"causes": causes} if causes else {})  # fmt: skip


def summary_of(doubted: Doubted) -> dict[str, Any]:
    """Return the content of `doubt.json`."""
    watch = doubted.watch
    return {
        "period_s": doubted.period_s,
        "state": watch.state,
        "windows": watch.windows,
        "windows_compared": watch.compared,
        "windows_too_still": watch.blind,
        "findings": [as_json(one) for one in doubted.findings],
        "isolability": watch.isolability(),
    }


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write `doubt.json`, whole or not at all."""
    write_json(path, summary, "doubt")
