"""A run that is followed: the same rows under the same numbers while it grows, once it is Parquet, after a restart."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.live_page.recorded.places import Place, folders_in, is_recording, newest_of, places_in
from rtctl.live_page.recorded.rows import RecordedRows
from rtctl.session.live.control_socket import is_listened_to
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
        self._without_rows: Place | None = None
        """The place that is wanted and has no row that could be read."""
        self.why = ""
        """Why not; "" where that is not known."""
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
        if self.has_no_row():
            return self._state_without_rows()
        assert self.place is not None
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

    def has_no_row(self) -> bool:
        """Return whether the run that stands here has no row: none ever had one, or an earlier run in its folder."""
        missing = self._without_rows
        if self.rows is None or self.place is None:
            return True
        return missing is not None and missing.folder == self.place.folder

    def stands_in(self) -> Path | None:
        """Return the folder of the run whose state is told; None: there is none."""
        place = self._without_rows if self.has_no_row() else self.place
        return None if place is None or place.record is not None else place.folder

    def _state_without_rows(self) -> str:
        """Return waiting | killed | ended of a run without a row: killed, if nobody is there who could record one."""
        place = self._without_rows
        if place is None:  # before a recording is begun there is only the socket
            heard = {is_listened_to(one) for one in folders_in(self.folder)}
            return "killed" if False in heard and True not in heard else "waiting"
        growing = place.folder / SIGNALS
        if not growing.is_file():
            return "ended"
        return "waiting" if is_recording(growing) or is_listened_to(place.folder) else "killed"

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
        self._without_rows = None
        if wanted is None or (wanted == self.place and not self._is_outdated()):
            return False
        try:
            opened = wanted.open()
        except (
            InputError,
            OSError,
        ) as error:  # before its first row, or between its end and its Parquet file
            self._without_rows = wanted
            self.why = str(error) if isinstance(error, InputError) else ""
            return False
        before = self.rows
        self.place, self.rows, self._ended_s = wanted, opened, None
        if before is None:
            return True
        known = before.count()
        before.close()
        return before.key != opened.key or opened.count() < known
