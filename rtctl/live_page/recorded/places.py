"""Runs and records in a folder: the folder itself, two levels below it (`rtctl demo`), the records of datasets."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rtctl.live_page.recorded.rows import GrowingRows, ParquetRows, RecordedRows, RecordRows
from rtctl.session.run_folder import SIGNALS

PARQUET, MANIFEST = "signals.parquet", "dataset.toml"
LOCKS = Path("/proc/locks")
HERE = "."
"""Name of the run that lies in the watched folder itself."""


class Place(NamedTuple):
    """Where a run or a record lies."""

    name: str
    """Path below the watched folder; a record's follows after a colon."""
    folder: Path
    record: int | None = None
    """Place of the record in the manifest of the folder's dataset; None: a run."""

    @property
    def file(self) -> Path:
        """The file that holds its rows: those under way, where there are any, lie beside those of an earlier run."""
        if self.record is not None:
            return self.folder / MANIFEST
        growing = self.folder / SIGNALS
        return growing if growing.is_file() else self.folder / PARQUET

    def open(self) -> RecordedRows:
        """Open its rows. Raises InputError where there is none yet, OSError where a file has just gone."""
        file = self.file
        if self.record is not None:
            return RecordRows(file, self.record)
        return GrowingRows(file) if file.name == SIGNALS else ParquetRows(file)


def places_in(folder: Path) -> list[Place]:
    """Return the runs and records in `folder` and two levels below it, by name."""
    return [place for one in folders_in(folder) for place in _places_of(one, folder)]


def folders_in(folder: Path) -> list[Path]:
    """Return `folder` and those two levels below it, by name."""
    folders = [folder]
    for one in _below(folder):
        folders += [one, *_below(one)]
    return folders


def newest_of(places: list[Place]) -> Place | None:
    """Return the place that is being recorded into, else the one that was written last; None: there is none.

    Records of one dataset were written in the order of its manifest.
    """
    return max(places, key=_freshness, default=None)


def is_recording(file: Path) -> bool:
    """Return whether a process holds the lock of a recording under way.

    Read from the kernel's table: a lock of our own, however short, could turn away a run that begins.
    """
    try:
        inode = file.stat().st_ino
        locks = LOCKS.read_text(encoding="ascii")
    except OSError:
        return False
    return any(_locks(line, inode) for line in locks.splitlines())


def _locks(line: str, inode: int) -> bool:
    """Return whether a line such as `1: FLOCK ADVISORY WRITE 10925 fe:00:2147327 0 EOF` is about `inode`."""
    words = line.split()
    return words[1:4] == ["FLOCK", "ADVISORY", "WRITE"] and words[5].rpartition(":")[2] == str(inode)


def _below(folder: Path) -> list[Path]:
    try:
        return sorted(one for one in folder.iterdir() if one.is_dir())
    except OSError:  # it has just gone, or may not be read
        return []


def _places_of(folder: Path, root: Path) -> Iterator[Place]:
    name = folder.relative_to(root).as_posix()
    if (folder / SIGNALS).is_file() or (folder / PARQUET).is_file():
        yield Place(name, folder)
    try:
        tables = tomllib.loads((folder / MANIFEST).read_text(encoding="utf-8")).get("records", [])
        names = [str(table.get("name") or Path(str(table["file"])).stem) for table in tables]
    except (
        OSError,
        ValueError,
        KeyError,
        AttributeError,
        TypeError,
    ):  # no manifest, or not one that can be shown
        return
    prefix = "" if name == HERE else f"{name}:"
    for number, one in enumerate(names):
        yield Place(f"{prefix}{one}", folder, number)


def _freshness(place: Place) -> tuple[bool, float, int]:
    growing, number = place.folder / SIGNALS, -1 if place.record is None else place.record
    try:
        if place.record is None and growing.is_file():
            return is_recording(growing), growing.stat().st_mtime, number
        file = place.folder / (PARQUET if place.record is None else MANIFEST)
        return False, file.stat().st_mtime, number
    except OSError:
        return False, 0.0, number
