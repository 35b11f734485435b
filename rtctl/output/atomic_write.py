"""Files that are whole or absent: written beside their place under another name, then renamed.

The contents reach the disk before the rename does, and the rename before the function returns, so that also a power
failure leaves the old file or the new one. Reference: POSIX.1-2017 rename, fsync.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rtctl.output.own_files import refuse_foreign, refuse_special


@contextmanager
def replacing(path: Path, command: str = "") -> Iterator[Path]:
    """Give a temporary path beside `path` to write to; at the end rename it, on an error remove it.

    The folder is made if it is absent. Each call has a temporary name of its own, so that two writers of one path do
    not mix their files. The rename is atomic: a reader of `path` sees the old file or the whole new one.

    Args:
        path: The file.
        command: Which command writes it: only what that wrote before is replaced. "": the caller knows what is there.

    Raises:
        InputError: `command` did not write the file that is there, or it is a device or a pipe.
    """
    refuse_special(path)
    if command:
        refuse_foreign(path, command)
    path.parent.mkdir(parents=True, exist_ok=True)
    stem = os.fsdecode(os.fsencode(path.name)[:200])  # a name has room for 255 bytes
    partial = path.with_name(f".{stem}.{secrets.token_hex(4)}.partial")
    try:
        yield partial
        _sync(partial)
        os.replace(partial, path)
        _sync(path.parent)
    except OSError as error:  # a full disk, which the system tells without a name
        if error.filename is None and error.errno is not None:
            error.filename = str(path)
        raise
    finally:
        partial.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Wait until the file or folder at `path` is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
