"""A run that is followed: the same rows under the same numbers while it grows, once it is Parquet, after a restart."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.live_page.recorded.places import Place, is_recording, newest_of, places_in
from rtctl.live_page.recorded.rows import RecordedRows
from rtctl.session.run_folder import SIGNALS

PLACES_EVERY_S = 1.0
"""How often the folder is searched for a newer run [s]."""
FILES_WITHIN_S = 10.0
"""How long a run that has ended may take to write its files before it counts as killed [s]."""


class FollowedRun:
    """Follows one named run of a folder, or whichever is the newest; used by one thread."""

    def __init__(self, folder: Path, name: str = "") -> None:
        """Start to follow; `name` "": the newest."""
        self.folder, self._name = folder, name
        self.place: Place | None = None
        self.rows: RecordedRows | None = None
        self._searched_s = float("-inf")
        self._ended_s: float | None = None

    def look(self) -> bool:
        """Look whether there is another recording than at the last look; return whether there is."""
        now_s = time.monotonic()
        if self._is_outdated() or now_s - self._searched_s > PLACES_EVERY_S:
            self._searched_s = now_s
            return self._reopen(self._wanted())
        return False

    def state(self) -> str:
        """Return how the recording stands: waiting | recording | ending | killed | ended."""
        if self.rows is None or self.place is None:
            return "waiting"
        growing = self.place.folder / SIGNALS
        if self.place.record is not None or not growing.is_file():
            return "ended"
        if is_recording(growing):
            self._ended_s = None
            return "recording"
        now_s = time.monotonic()
        if self._ended_s is None:  # when it was written last, as far as that is known
            with suppress(OSError):
                self._ended_s = now_s - max(time.time() - growing.stat().st_mtime, 0.0)
        return "ending" if now_s - (self._ended_s or now_s) < FILES_WITHIN_S else "killed"

    def close(self) -> None:
        """Close the files."""
        if self.rows is not None:
            self.rows.close()
            self.rows = None

    def _is_outdated(self) -> bool:
        """Return whether the rows that are open are not those of the place, or no longer."""
        rows, place = self.rows, self.place
        return rows is None or place is None or rows.replaced() or rows.path != place.file

    def _wanted(self) -> Place | None:
        places = places_in(self.folder)
        if not self._name:
            return newest_of(places)
        return next((one for one in places if one.name == self._name), None)

    def _reopen(self, wanted: Place | None) -> bool:
        """Open `wanted` unless it is open; return whether it is another recording."""
        if wanted is None or (wanted == self.place and not self._is_outdated()):
            return False
        try:
            opened = wanted.open()
        except (InputError, OSError):  # before its first row, or between its end and its Parquet file
            return False
        before = self.rows
        self.place, self.rows, self._ended_s = wanted, opened, None
        if before is None:
            return True
        known = before.count()
        before.close()
        return before.key != opened.key or opened.count() < known
