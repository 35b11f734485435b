"""A recording as MCAP messages: its rows, errors and times, what was changed, what happened.

| topic | a message |
|---|---|
| /signals | all columns of a row, under their recorded names |
| /errors | tracking and self-sensing error of the row |
| /timing | lateness, round trip and compute time of the sample [us] |
| /parameters | set-point and gains that were set from outside, after each change |
| /events | start, change, refused change, fault, re-arming, in words |

The time of a message is that of its sample in the run: period * index, in nanoseconds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, RunError
from rtctl.border.mechanisms import plain_unit
from rtctl.live_page.recorded.rows import INDEX
from rtctl.live_page.recorded.timing_rows import TimingRows
from rtctl.live_page.shown.description import Description
from rtctl.live_page.shown.event_log import EventLog
from rtctl.live_page.streams.growing_mcap import GrowingMcap, Topic
from rtctl.loop.supervisor import TIMING_COLUMNS
from rtctl.session.live.control_socket import PARAMETERS as PARAMETER_UNITS
from rtctl.session.live.control_socket import parameters
from rtctl.session.run_folder import MODEL

SIGNALS, ERRORS, TIMING, PARAMETERS, EVENTS = "/signals", "/errors", "/timing", "/parameters", "/events"
ROWS_OF_A_READ = 4096
ERROR_ROLES = {"error": "tracking_error", "sensing_error": "self_sensing_error"}
SUMMARY = "summary.json"
TOML, JSON = "application/toml", "application/json"


class RunMcap:
    """Writes one recording into one file, as far as it has come."""

    def __init__(self, path: Path, description: Description) -> None:
        """Begin the file. Raises as `GrowingMcap`."""
        self.path, self.rows = path, 0
        """`rows`: how many are written."""
        self._file = GrowingMcap(path)
        place, is_run = description.place, description.place.record is None
        self._period_ns = 1e9 * description.period_s
        has_times = is_run and PARAMETER_UNITS not in description.rows.metadata
        self._timing = TimingRows(place.folder) if has_times else None
        self._events = EventLog(place.folder, description.scenario, description.period_s) if is_run else None
        self._events_written = 0
        self._parameters: dict[str, float] = {}
        self._begin(description)

    def look(self, description: Description) -> int:
        """Write what has been recorded since the last look, and save the file; return how many rows it was.

        Args:
            description: The recording, in its present file.

        Raises:
            OSError: the disk is full.
        """
        before, last = self.rows, self._complete(description)
        while self.rows < last:
            upto = min(last, self.rows + ROWS_OF_A_READ)
            self._write_rows(description, self.rows, upto)
            self.rows = upto
        written = self._write_events()
        if self.rows > before or written or not before:
            self._file.save()
        return self.rows - before

    def end(self, description: Description) -> None:
        """Add the summary of a run that has ended, and close the file."""
        self._attach(description.place.folder / SUMMARY, JSON)
        self._file.save()
        self.close()

    def close(self) -> None:
        """Close all files."""
        self._file.close()
        if self._timing is not None:
            self._timing.close()

    def _begin(self, description: Description) -> None:
        rows, folder = description.rows, description.place.folder
        file, units = self._file, {name: plain_unit(unit) for name, unit in rows.columns}
        page = description.for_page()
        file.describe(
            "rtctl",
            {"title": page["title"], "period_s": repr(description.period_s),
             "clock": "live" if page["live"] else "lockstep"},
        )  # fmt: skip
        file.register(_numbers(SIGNALS, "rtctl.Signals", units))
        errors = [one for one in description.shown.signals if one.role in ERROR_ROLES]
        if errors:
            names = {ERROR_ROLES[one.role]: one.unit for one in errors}
            file.register(_numbers(ERRORS, "rtctl.Errors", names))
        if self._timing is not None:
            file.register(_numbers(TIMING, "rtctl.Timing", dict(TIMING_COLUMNS)))
        if self._events is None:
            return
        known = {name: plain_unit(unit) for name, unit in description.parameter_units().items()}
        if known:
            file.register(_numbers(PARAMETERS, "rtctl.Parameters", known))
        file.register(Topic(EVENTS, "rtctl.Event", {"kind": {"type": "string"}, "text": {"type": "string"}}))
        if "scenario" in rows.metadata:
            file.attach("scenario.toml", TOML, rows.metadata["scenario"].encode())
        self._attach(folder / MODEL, TOML)
        with suppress(InputError, RunError):  # it has ended, or was begun without a control socket
            self._parameters = dict(parameters(folder))
            if self._parameters and known:
                file.add(PARAMETERS, 0, self._parameters)

    def _complete(self, description: Description) -> int:
        """Return how many rows are there, with their times."""
        count = description.rows.count()
        if self._timing is None:
            return count
        try:
            return min(count, self._timing.count())
        except (InputError, OSError):  # before its first row, or a recording without times
            return count if description.rows.path.suffix == ".parquet" else 0

    def _write_rows(self, description: Description, first: int, last: int) -> None:
        table = description.rows.read(first, last)
        samples = table[INDEX] if INDEX in table else np.arange(first, last, dtype=np.float64)
        times = [round(self._period_ns * sample) for sample in samples.tolist()]
        self._write(SIGNALS, times, first, list(table), table.values())
        errors = [
            (ERROR_ROLES[one.role], number)
            for number, one in enumerate(description.shown.signals)
            if one.role in ERROR_ROLES
        ]
        if errors:
            shown = description.shown.matrix(table)
            self._write(ERRORS, times, first, [name for name, _ in errors], [shown[k] for _, k in errors])
        if self._timing is not None:
            with suppress(InputError, OSError):
                timing = self._timing.read(first, last)
                self._write(TIMING, times, first, list(timing), timing.values())

    def _write(
        self, topic: str, times: list[int], first: int, names: list[str], columns: Iterable[FloatArray]
    ) -> None:
        """Write a message a row; values that are no numbers are left out."""
        rows = np.stack(list(columns)).T.tolist()
        for k, (time_ns, row) in enumerate(zip(times, rows, strict=True), first + 1):
            message = {name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)}
            self._file.add(topic, time_ns, message, k)

    def _write_events(self) -> bool:
        """Write the events that are new, and the parameters after each change; return whether there were any."""
        events = None if self._events is None else self._events.changed()
        if self._events is None or not events:
            return False
        new = events[self._events_written :]
        for event in new:
            time_ns = round(self._period_ns * event.step)
            self._file.add(EVENTS, time_ns, {"kind": event.kind, "text": self._events.words(event)})
            if event.kind == "change":
                name, value = str(event.values["name"]), float(event.values["value"])
                self._parameters = {**self._parameters, name: value}
                told = {one: number for one, number in self._parameters.items() if math.isfinite(number)}
                self._file.add(PARAMETERS, time_ns, told)
        self._events_written = len(events)
        return bool(new)

    def _attach(self, path: Path, kind: str) -> None:
        with suppress(FileNotFoundError):
            self._file.attach(path.name, kind, path.read_bytes())


def _numbers(topic: str, schema: str, units: Mapping[str, str]) -> Topic:
    """Return a topic whose fields are numbers with units."""

    def field(unit: str) -> dict[str, Any]:
        return {"type": "number", "description": f"[{unit}]", "unit": unit} if unit else {"type": "number"}

    return Topic(topic, schema, {name: field(unit) for name, unit in units.items()})
