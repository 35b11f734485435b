"""Backup of a dataset that a new one would replace: measured data are never overwritten."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path

from rtctl.border.errors import RunError

MANIFEST = "dataset.toml"


def dataset_files(folder: Path) -> list[Path]:
    """Return the files of the dataset in `folder`, its records and then its manifest; [] where there is none."""
    manifest = folder / MANIFEST
    if not manifest.is_file():
        return []
    try:
        tables = tomllib.loads(manifest.read_text(encoding="utf-8")).get("records", [])
        files = [folder / str(table["file"]) for table in tables if "file" in table]
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        files = sorted(folder.glob("*.parquet"))  # what a new dataset might be written over
    return list(dict.fromkeys([*files, manifest]))


def put_aside(folder: Path) -> Path | None:
    """Move the dataset in `folder`, its manifest and the records beside it, to a folder within; None: there is none.

    Raises RunError where it cannot be moved.
    """
    files = dataset_files(folder)
    if not files:
        return None
    name = "before-" + time.strftime("%Y%m%d-%H%M%S")
    aside, again = folder / name, 1
    while aside.exists():
        aside, again = folder / f"{name}-{again}", again + 1
    try:
        aside.mkdir()
        for file in files:  # the manifest last: what looks whole is whole
            if file.parent == folder and file.is_file():
                file.rename(aside / file.name)
    except OSError as error:
        why = error.strerror or error
        raise RunError(
            f"{folder} holds a dataset that cannot be moved to {aside} ({why}): choose another --out"
        ) from None
    return aside
