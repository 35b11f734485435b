"""An oscillator's model file as rtctl reads and writes it; its meaning is `plant_sim`'s."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from rtctl.border.model_file import ModelFile, read_model_file
from rtctl.output.atomic_write import replacing

KIND = "oscillator"


def read_oscillator_model(path: Path) -> ModelFile:
    """The checked model file; `model.value("damping", "1/s")`. Raises InputError."""
    return read_model_file(path, KIND)


def write_oscillator_model(path: Path, model: ModelFile) -> None:
    """The file, whole or not at all."""
    text = tomli_w.dumps(model.model_dump(exclude_none=True, exclude_defaults=True))
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")
