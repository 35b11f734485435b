"""The events of a run in words: what was changed, what went wrong, when."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.loop.events import Event, read_events
from rtctl.output.readable_units import printed_unit
from rtctl.scenario.schema import Scenario
from rtctl.session.live.injected_faults import INJECTED
from rtctl.session.live.successors import model_name
from rtctl.session.run_files import marks_of
from rtctl.session.run_folder import EVENTS

MOST_EVENTS = 500
"""Events that the page lists: the newest ones."""


class EventLog:
    """Reads `events.jsonl` of one folder anew whenever it has changed."""

    def __init__(self, folder: Path, scenario: Scenario | None, period_s: float) -> None:
        self._path, self._scenario, self._period_s = folder / EVENTS, scenario, period_s
        self._stamp: tuple[int, int] | None = None

    def look(self) -> list[dict[str, Any]] | None:
        """Return the newest events as time [s], kind and text; None: nothing has changed since the last look."""
        events = self.changed()
        if events is None:
            return None
        return [
            {"time_s": self.time_s(event), "kind": event.kind, "text": self._printed(event)}
            for event in events[-MOST_EVENTS:]
        ]

    def changed(self) -> list[Event] | None:
        """Return all events; None: nothing has changed since the last look."""
        try:
            found = self._path.stat()
        except OSError:
            return None
        stamp = (found.st_ino, found.st_size)
        if stamp == self._stamp:
            return None
        self._stamp = stamp
        with suppress(InputError, ValueError, KeyError):  # it may be replaced at this moment
            return list(read_events(self._path))
        return []

    def time_s(self, event: Event) -> float:
        """Return the time of an event in the run [s]."""
        return self._period_s * event.step

    def _printed(self, event: Event) -> str:
        """Return an event's sentence with the unit of a change as the charts print it; programs get plain ones."""
        words = self.words(event)
        return printed_unit(words) if event.kind == "change" and self._scenario is not None else words

    def words(self, event: Event) -> str:
        """Return an event as a sentence for a person."""
        if event.kind in ("change", "refused") and self._scenario is not None:
            text = marks_of(self._scenario, [event])[0].text
            return f"{text}: {event.values['message']}" if event.kind == "refused" else text
        if event.kind in ("fault", INJECTED):
            return f"{event.values.get('fault', '')}: {event.values.get('message', '')}"
        if event.kind == "change":
            return str(event.values.get("message", event.values.get("name", "")))
        if event.kind == "model":
            return f"estimator and tuning of {model_name(int(event.values['number']))} took over"
        if event.kind == "doubt":
            done = event.values.get("done", "")
            return f"{event.values.get('kind', '')}: {event.values.get('message', '')}{'; ' if done else ''}{done}"
        return {"start": "loop started", "rearmed": "device armed again"}.get(event.kind, event.kind)
