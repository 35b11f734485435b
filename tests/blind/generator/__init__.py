"""Blind cases: measured data with a hidden effect, or none, drawn from a seed; the cause must be named from the files.

Imports nothing of the project: equations, integrator, holds and noise are written out again, so that a mistake of the
project's own simulator cannot hide in the data it is judged on.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .options import Options
from .oscillator import generate_oscillator
from .truth import OUTSIDE, Effect, Noise, Quantity, RecordTruth, Truth

__all__ = ["OUTSIDE", "Effect", "Noise", "Options", "Quantity", "RecordTruth", "Truth", "generate"]

PLANTS: dict[str, Callable[[int, Path, Options], Truth]] = {"oscillator": generate_oscillator}
"""One line a plant. A vo2 goes here: vo2.py with its own device, effects and `generate_vo2`; files.py, noise.py and
sizing.py serve it too."""


def generate(seed: int, folder: Path, plant: str = "oscillator", **overrides: Any) -> Truth:
    """Write dataset.toml, model.toml and data files of this seed into `folder`; the truth is only returned.

    `overrides` are the fields of Options. Raises ValueError for an unknown plant or effect, TypeError for an unknown
    override, RuntimeError where no draw of this seed makes the wanted effect.
    """
    if plant not in PLANTS:
        raise ValueError(f"no plant {plant!r}; there are {', '.join(PLANTS)}")
    return PLANTS[plant](seed, Path(folder), Options(**overrides))
