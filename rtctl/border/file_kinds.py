"""What a TOML file is, by its tables: so that one in the place of another is told at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError

FILE_KINDS = {
    "dataset": "the manifest of a dataset (dataset.toml)",
    "model": "a model file (model.toml)",
    "scenario": "a scenario",
}
"""Kinds of files by the table that each of them has."""


def check_file_kind(tables: Mapping[str, Any], path: Path, wanted: str) -> None:
    """Raise InputError for a file of another kind than `wanted`; one of no known kind passes."""
    if wanted in tables:
        return
    for table, words in FILE_KINDS.items():
        if isinstance(tables.get(table), dict):
            raise InputError(
                f"{path}: is {words}, {FILE_KINDS[wanted]} is needed here; are two files in each other's place?"
            )
