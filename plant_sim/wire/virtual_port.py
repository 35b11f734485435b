"""A serial port that exists only in the kernel: a pty whose slave appears under a chosen path."""

from __future__ import annotations

import os
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rtctl.border.errors import InputError


@contextmanager
def virtual_port(path: Path) -> Iterator[int]:
    """Yield the master's file descriptor, while `path` is a link to the slave. Raises InputError.

    The slave stays open here: without a reader the master would report EIO after each client, and be busy.
    """
    _make_room(path)
    master, slave = os.openpty()
    try:
        tty.setraw(slave)
        target = os.ttyname(slave)
        try:
            path.symlink_to(target)
        except OSError as error:
            raise InputError(f"{path}: cannot make the serial port's link: {error.strerror}") from None
        try:
            yield master
        finally:
            with suppress(OSError):
                if os.readlink(path) == target:
                    path.unlink()
    finally:
        os.close(slave)
        os.close(master)


def _make_room(path: Path) -> None:
    """Remove the dangling link that a killed server left; anything else is the user's."""
    if path.is_symlink():
        if path.exists():
            raise InputError(
                f"{path}: is a link to {os.readlink(path)}, which is in use; is another device served there? "
                "Stop it, remove the link or choose another path"
            )
        path.unlink(missing_ok=True)
    elif path.exists():
        raise InputError(f"{path}: exists and is not a serial port's link; choose another path")
