"""Writing a model file of a functional mock-up unit; its meaning belongs to `plant_sim`."""

from __future__ import annotations

import os
from pathlib import Path

from rtctl.border.equations.fmu_file import FmuFile
from rtctl.models.provenance import write_model_file


def write_fmu_model(path: Path, model: FmuFile) -> None:
    """Write the file, whole or not at all; it names the unit relative to its own folder."""
    tables = model.model_dump(exclude_none=True, exclude_defaults=True)
    tables["model"]["file"] = Path(os.path.relpath(model.model.file, path.resolve().parent)).as_posix()
    write_model_file(path, tables, tables.get("provenance", {}))
