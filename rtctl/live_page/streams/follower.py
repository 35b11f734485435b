"""A run that is followed by a stream: which recording it is, and how many of its rows the stream has taken."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rtctl.live_page.recorded.followed import FollowedRun
from rtctl.live_page.shown.description import Description, description_of


class Follower:
    """Follows the newest run of a folder, or a named one; used by one thread."""

    def __init__(self, folder: Path, name: str = "") -> None:
        """Start to follow; `name` "": the newest."""
        self._followed = FollowedRun(folder, name)
        self.description: Description | None = None
        """The recording under its present file; None: there is none yet."""
        self.taken = 0
        """Rows of it that the stream has taken; kept by the stream."""

    def look(self) -> bool:
        """Return whether another recording has begun since the last look; of that no row is taken."""
        begun = self._followed.look()
        rows, place = self._followed.rows, self._followed.place
        if rows is None or place is None:
            return False
        if begun or self.description is None:
            self.description, self.taken = description_of(rows, place), 0
            return True
        if self.description.rows is not rows:  # the same rows, by now in another file
            self.description = replace(self.description, rows=rows)
        return False

    def state(self) -> str:
        """Return how the recording stands: waiting | recording | ending | killed | ended."""
        return self._followed.state()

    def close(self) -> None:
        """Close the files."""
        self._followed.close()
