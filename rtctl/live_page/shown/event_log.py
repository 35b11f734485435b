"""The events of a run in words: what was changed, what went wrong, when."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.loop.events import Event, read_events
from rtctl.scenario.schema import Scenario
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
        """Return all events as time [s], kind and text; None: nothing has changed since the last look."""
        try:
            found = self._path.stat()
        except OSError:
            return None
        stamp = (found.st_ino, found.st_size)
        if stamp == self._stamp:
            return None
        self._stamp = stamp
        events: Iterable[Event] = ()
        with suppress(InputError, ValueError, KeyError):  # it may be replaced at this moment
            events = list(read_events(self._path))[-MOST_EVENTS:]
        return [
            {"time_s": self._period_s * event.step, "kind": event.kind, "text": self._words(event)}
            for event in events
        ]

    def _words(self, event: Event) -> str:
        if event.kind in ("change", "refused") and self._scenario is not None:
            text = marks_of(self._scenario, [event])[0].text
            return f"{text}: {event.values['message']}" if event.kind == "refused" else text
        if event.kind == "fault":
            return f"{event.values.get('fault', '')}: {event.values.get('message', '')}"
        return {"start": "loop started", "rearmed": "device armed again"}.get(event.kind, event.kind)
