"""Reading an oscillator's model file; its meaning belongs to `plant_sim`."""

from __future__ import annotations

from pathlib import Path

from rtctl.border.model_file import ModelFile, read_model_file

KIND = "oscillator"


def read_oscillator_model(path: Path) -> ModelFile:
    """Return the checked model file; `model.value("damping", "1/s")`. Raises InputError."""
    return read_model_file(path, KIND)
