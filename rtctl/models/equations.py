"""Writing a model file of equations; its meaning belongs to `plant_sim`."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from rtctl.border.equations.file import EquationsFile
from rtctl.output.atomic_write import replacing


def write_equations_model(path: Path, model: EquationsFile) -> None:
    """Write the file, whole or not at all; numbers that are plain in an expression stay as texts."""
    text = tomli_w.dumps(model.model_dump(exclude_none=True, exclude_defaults=True))
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")
