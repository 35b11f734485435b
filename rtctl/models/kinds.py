"""Which kind of plant a model file is of, before anything else in it is looked at."""

from __future__ import annotations

from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.border.file_kinds import check_file_kind
from rtctl.border.units.quantities import read_toml


def model_kind(path: Path) -> str:
    """`model.kind` of the file; "fmu" of a functional mock-up unit. Raises InputError where it is not a text."""
    if path.suffix.lower() == ".fmu":
        return "fmu"
    tables = read_toml(path)
    check_file_kind(tables, path, "model")
    model = tables.get("model")
    if not isinstance(model, dict):
        raise InputError(f"{path}: table [model] is missing")
    kind = model.get("kind")
    if not isinstance(kind, str):
        raise InputError(f'{path}: key "model.kind" must be a text such as "oscillator", got {kind!r}')
    return kind
