"""Writing a model file of equations; its meaning belongs to `plant_sim`."""

from __future__ import annotations

from pathlib import Path

from rtctl.border.equations.file import EquationsFile
from rtctl.models.provenance import write_model_file


def write_equations_model(path: Path, model: EquationsFile) -> None:
    """Write the file, whole or not at all; numbers that are plain in an expression stay as texts."""
    tables = model.model_dump(exclude_none=True, exclude_defaults=True)
    write_model_file(path, tables, tables.get("provenance", {}))
