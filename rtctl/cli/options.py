"""What several verbs share: where results go, how they are printed as JSON."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.output.own_files import mark_of, refuse_foreign, refuse_read


def output_folder(path: Path) -> Path:
    """Return `path` after a check that a folder can be written there, before anything moves. Raises InputError."""
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir():
        raise InputError(f"--out {path}: {existing} is a file, a folder is needed")
    try:
        # permission bits say nothing to root, nor of odd file systems
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        raise InputError(
            f"--out {path}: {existing} cannot be written to: {error.strerror or error}"
        ) from None
    return path


def is_quiet(args: argparse.Namespace) -> bool:
    """Return whether nothing but the result and errors is wanted."""
    return bool(args.quiet or args.json)


def print_json(content: Mapping[str, Any] | Sequence[Any], command: str = "") -> None:
    """Print a result as JSON on standard output; numbers that are not finite become null.

    With `command`, a mapping is printed as the file that this command writes of it.
    """
    import json

    from rtctl.evaluation.metrics import finite

    if command and isinstance(content, Mapping):
        content = {"program": mark_of(command), **content}
    print(json.dumps(finite(content), indent=2))


def output_file(path: Path, what: str, command: str, sources: Sequence[Path] = ()) -> Path:
    """Return `path` after a check that `command` may write a file there, which is none of its `sources`.

    Raises InputError also where a file is there that this command did not write.
    """
    output_folder(path.parent)
    if path.is_dir():
        raise InputError(f"--out {path}: is a folder, {what} is needed")
    refuse_read([path], sources)
    refuse_foreign(path, command)
    return path
