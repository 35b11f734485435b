"""What a command may write over: files that the same command wrote before, and nothing else.

Each file that a command writes has in it the text `rtctl COMMAND VERSION`, such as "rtctl simulate 0.2.0": a comment, a
key or a field of metadata, as its format allows. A file that is there without that text, measured data above all, is
left as it is and the command refused. What is asked is the file, not its name: a name says nothing of who wrote it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.version import __version__

END_BYTES = 1 << 16
"""The text is sought in so much of a file's begin and of its end: metadata of Parquet and archives are at the end."""


def mark_of(command: str) -> str:
    """Return the text by which a file says that a command wrote it: `rtctl simulate 0.2.0`."""
    return f"rtctl {command} {__version__}"


def is_written_by(path: Path, command: str) -> bool:
    """Return whether the file at `path` was written by `command` of any version. Raises OSError."""
    with path.open("rb") as file:
        begin = file.read(END_BYTES)
        file.seek(max(path.stat().st_size - END_BYTES, 0))
        end = file.read(END_BYTES)
    mark = re.compile(rb"rtctl %s \d+\.\d+" % re.escape(command.encode()))
    return mark.search(begin) is not None or mark.search(end) is not None


def refuse_foreign(path: Path, command: str) -> None:
    """Raise InputError where a file or folder is at `path` that `command` did not write; an empty file is nothing."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder, and is not written over; choose another --out")
    if not path.is_file():  # nothing, a link to nothing, or a device or pipe: written to, it keeps nothing
        return
    try:
        is_own = path.stat().st_size == 0 or is_written_by(path, command)
    except OSError:
        is_own = False
    if not is_own:
        raise InputError(
            f"{path}: is there already, and no output of rtctl {command}: it is not written over; choose "
            "another --out, or move that file away"
        )


def refuse_special(path: Path) -> None:
    """Raise InputError where a device, a pipe or a socket is at `path`: a rename would put a file in its place.

    What is written to as it is, such as a stream, may go to one.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(
            f"{path}: is a device, a pipe or a socket, and no file is written there; choose another --out"
        )


def refuse_read(targets: Iterable[Path], sources: Iterable[Path]) -> None:
    """Raise InputError where a file that a command reads is one that it would write over."""
    read = {source.resolve() for source in sources}
    for target in targets:
        if target.resolve() in read:
            raise InputError(
                f"{target}: is read by this command, and is not written over; choose another --out"
            )
