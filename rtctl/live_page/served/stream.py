"""What one viewer is sent: the recording, its rows from where the viewer has them, events, timing, state.

The recording is the buffer: a viewer that is slow, or comes back, is served from the file, a frame at a time. One that
is too far behind skips to the newest rows and is told which ones it missed; they are in `history` all the same.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.live_page.recorded.followed import FollowedRun
from rtctl.live_page.recorded.rows import INDEX
from rtctl.live_page.served.packing import packed, server_sent
from rtctl.live_page.shown.description import Description, description_of
from rtctl.live_page.shown.event_log import EventLog
from rtctl.live_page.shown.state import verdict_of, words_of
from rtctl.live_page.shown.timing import TimingHistograms

FRAMES_A_SECOND = 30.0
WINDOW_ROWS = 16384
"""Rows that the page keeps; a new viewer gets so many, and one that is further behind skips to them."""
RESUME_ROWS = 1 << 18
"""Rows that a viewer that comes back may have missed without skipping any."""
ROWS_OF_A_FRAME = 4096
STATE_EVERY_S = 0.25
TIMING_EVERY_S = 1.0
BEAT_EVERY_S = 2.0
"""How often something is sent in any case, which shows whether the viewer is still there [s]."""
RETRY_MS = 500
"""After which time a browser that lost the server asks again [ms]."""


class Stream:
    """The events for one viewer; used by one thread."""

    def __init__(self, folder: Path, name: str, last_event: str) -> None:
        """Start to follow a run.

        Args:
            folder: the watched folder.
            name: the run in it; "": the newest.
            last_event: `KEY-ROW`, the last event that the viewer has; "": none.
        """
        self._followed = FollowedRun(folder, name)
        self._last_event = last_event
        self._description: Description | None = None
        self._sent = 0
        """Rows that the viewer has."""
        self._most_behind = RESUME_ROWS
        self._events: EventLog | None = None
        self._timing: TimingHistograms | None = None
        self._state: dict[str, Any] = {}
        self._due_s = {"state": 0.0, "timing": 0.0, "beat": time.monotonic() + BEAT_EVERY_S}

    def first(self) -> bytes:
        """Return what opens the stream."""
        return f"retry: {RETRY_MS}\n\n".encode()

    def look(self) -> Iterator[bytes]:
        """Yield what is new since the last look, a frame at a time."""
        if self._followed.look():
            yield self._begin()
        elif self._description is not None and self._description.rows is not self._followed.rows:
            assert self._followed.rows is not None  # the same rows, by now in another file
            self._description = replace(self._description, rows=self._followed.rows)
        if self._description is not None:
            yield from self._rows(self._description)
        yield from self._others()

    def close(self) -> None:
        """Close all files."""
        self._followed.close()
        if self._timing is not None:
            self._timing.close()

    def _begin(self) -> bytes:
        """Turn to another recording; return its description as an event."""
        assert self._followed.rows is not None
        assert self._followed.place is not None
        description = description_of(self._followed.rows, self._followed.place)
        count, key = description.rows.count(), description.rows.key
        known, _, row = self._last_event.partition("-")
        self._last_event = ""
        resumed = known == key and row.isdecimal() and int(row) <= count
        self._sent = int(row) if resumed else max(0, count - WINDOW_ROWS)
        self._most_behind = RESUME_ROWS
        self._description, self._state = description, {}
        if self._timing is not None:
            self._timing.close()
        is_run = description.place.record is None
        self._timing = TimingHistograms(description.place.folder) if is_run else None
        self._events = (
            EventLog(description.place.folder, description.scenario, description.period_s) if is_run else None
        )
        self._due_s |= {"state": 0.0, "timing": 0.0}
        return server_sent("run", {**description.for_page(), "rows": count, "next": self._sent + 1})

    def _rows(self, description: Description) -> Iterator[bytes]:
        count = description.rows.count()
        if count - self._sent > self._most_behind:
            begin = count - WINDOW_ROWS
            yield server_sent("skipped", {"first": self._sent + 1, "last": begin})
            self._sent = begin
        while self._sent < count:
            last = min(count, self._sent + ROWS_OF_A_FRAME)
            yield rows_event(description, self._sent, last)
            self._sent = last
        self._most_behind = WINDOW_ROWS

    def _others(self) -> Iterator[bytes]:
        if self._is_due("state", STATE_EVERY_S):
            if self._events is not None and (events := self._events.look()) is not None:
                yield server_sent("events", events)
            if (state := self._stands()) != self._state:
                self._state = state
                yield server_sent("state", state)
        if self._timing is not None and self._is_due("timing", TIMING_EVERY_S):
            timing = self._timing.look()
            if timing is not None:
                yield server_sent("timing", timing)
        if self._is_due("beat", BEAT_EVERY_S):
            yield b": beat\n\n"

    def _stands(self) -> dict[str, Any]:
        state, folder = self._followed.state(), self._followed.stands_in()
        words = words_of(state, self._followed.why if self._followed.has_no_row() else None)
        verdict = verdict_of(folder) if folder is not None and state == "ended" else None
        return {"state": state, "words": words, "summary": verdict}

    def _is_due(self, what: str, every_s: float) -> bool:
        now_s = time.monotonic()
        if now_s < self._due_s[what]:
            return False
        self._due_s[what] = now_s + every_s
        return True


def rows_event(description: Description, first: int, last: int) -> bytes:
    """Return the rows `first` to before `last` as an event; its rows are numbered from 1, as in the recording.

    `samples` are the numbers of the samples in the plan (int32), `values` the signals one after the other (float32).
    """
    table = description.rows.read(first, last)
    samples = table[INDEX] if INDEX in table else np.arange(first, last, dtype=np.float64)
    content = {
        "first": first + 1,
        "count": last - first,
        "samples": packed(samples, "<i4"),
        "values": packed(description.shown.matrix(table)),
    }
    return server_sent("rows", content, f"{description.rows.key}-{last}")
