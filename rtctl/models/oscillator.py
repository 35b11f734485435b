"""Reading and writing an oscillator's model file; its meaning belongs to `plant_sim`."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from rtctl.border.model_file import ModelFile, read_model_file
from rtctl.output.atomic_write import replacing

KIND = "oscillator"


def read_oscillator_model(path: Path) -> ModelFile:
    """Return the checked model file; `model.value("damping", "1/s")`. Raises InputError."""
    return read_model_file(path, KIND)


def write_oscillator_model(path: Path, model: ModelFile) -> None:
    """Write the file, whole or not at all."""
    text = tomli_w.dumps(model.model_dump(exclude_none=True, exclude_defaults=True))
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")
