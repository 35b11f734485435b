"""MCAP files of what a folder holds: one while it is recorded, or all at once of what was recorded."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

from rtctl.border.errors import InputError, RunError
from rtctl.extras import require
from rtctl.live_page.recorded.places import HERE, places_in
from rtctl.live_page.streams.follower import Follower
from rtctl.live_page.streams.mcap_run import RunMcap
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import refuse_foreign

SAVE_EVERY_S = 1.0
"""How often a file that grows is brought up to date: at most so much of a run is missing in it after a kill [s]."""

OVER = ("ended", "killed")


class McapRecorder:
    """Follows the newest run of a folder into a file; a further run gets a file of its own, FILE-2.mcap."""

    def __init__(self, folder: Path, file: Path) -> None:
        """Prepare to record. Raises InputError where `file` is none that could be written, or mcap is missing."""
        check_target(file, "--mcap")
        require("mcap", "--mcap")
        self._follower, self._file, self._begun = Follower(folder), file, 0
        self._run: RunMcap | None = None
        self._due_s, self._is_over = 0.0, False

    def look(self) -> None:
        """Write what is new, at most once a second. Raises RunError where the file cannot be written any more."""
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + SAVE_EVERY_S
        try:
            self._follow()
        except OSError as error:
            self._close()
            raise RunError(
                f"--mcap {self._numbered()}: cannot be written any more: {error.strerror or error}; what was saved "
                "last stays, and rtctl export mcap writes a new one"
            ) from None

    def close(self) -> None:
        """Write what is new, and close the files."""
        if self._run is not None and self._follower.description is not None:
            with suppress(OSError):  # a disk that is full: what was saved last stays
                self._run.look(self._follower.description)
        self._close()
        self._follower.close()

    def _follow(self) -> None:
        begun, description = self._follower.look(), self._follower.description
        if description is None:
            return
        if begun:
            self._close()
            self._begun += 1
            self._run = RunMcap(self._numbered(), description)
        if self._run is None:  # it has ended and is complete
            return
        new, was_over = self._run.look(description), self._is_over
        self._is_over = new == 0 and self._follower.state() in OVER
        if self._is_over and was_over:  # the second time: its summary is written a moment after its rows
            self._run.end(description)
            self._run = None

    def _close(self) -> None:
        if self._run is not None:
            self._run.close()
            self._run = None

    def _numbered(self) -> Path:
        file = self._file
        return file if self._begun == 1 else file.with_name(f"{file.stem}-{self._begun}{file.suffix}")


def export_mcap(folder: Path, file: Path) -> int:
    """Write what `folder` holds by now into an MCAP file, whole or not at all; return how many rows it has.

    Raises:
        InputError: nothing, or more than one run, is recorded there, or the package mcap is missing.
    """
    check_target(file, "--out")
    follower = Follower(folder, _only_run(folder))
    try:
        follower.look()
        if follower.description is None:
            raise InputError(f"{folder}: nothing is recorded there; give the folder of a run (its --out)")
        with replacing(file) as partial:
            run = RunMcap(Path(partial), follower.description)
            try:
                run.look(follower.description)
                run.end(follower.description)
            finally:
                run.close()
        return run.rows
    finally:
        follower.close()


def check_target(file: Path, option: str) -> None:
    """Raise InputError where `file` cannot be an MCAP file, or another file is there."""
    refuse_foreign(file, "export mcap")
    if file.suffix != ".mcap":
        raise InputError(f"{option} {file}: the name must end with .mcap, by which viewers know the format")
    if file.is_dir() or not file.absolute().parent.is_dir():
        what = "is a folder" if file.is_dir() else "there is no such folder"
        raise InputError(f"{option} {file}: {what}; give the name of a file in a folder that is there")


def _only_run(folder: Path) -> str:
    """Return the name of the only recording in `folder`: the one in it itself, or the only one below."""
    names = [place.name for place in places_in(folder)]
    if HERE in names or len(names) <= 1:
        return HERE if HERE in names else "".join(names)
    raise InputError(
        f"{folder}: several runs are recorded below it ({', '.join(names[:8])}{', ...' if len(names) > 8 else ''}); "
        f"give the folder of one of them"
    )
