"""Blind cases: measured data with a hidden effect, or none, drawn from a seed; the cause must be named from the files.

Imports nothing of the project: equations, integrator, holds and noise are written out again, so that a mistake of the
project's own simulator cannot hide in the data it is judged on.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .stale_caches import drop_stale_caches

drop_stale_caches(Path(__file__).parent)

from .more import more  # noqa: E402
from .options import Options  # noqa: E402
from .oscillator import generate_oscillator  # noqa: E402
from .truth import OUTSIDE, Effect, Noise, Quantity, RecordTruth, Truth  # noqa: E402
from .vo2 import Vo2Options, Vo2Truth, generate_vo2  # noqa: E402

__all__ = [
    "OUTSIDE",
    "Effect",
    "Noise",
    "Options",
    "Quantity",
    "RecordTruth",
    "Truth",
    "Vo2Options",
    "Vo2Truth",
    "generate",
    "more",
]

PLANTS: dict[str, tuple[type, Callable[[int, Path, Any], Any]]] = {
    "oscillator": (Options, generate_oscillator),
    "vo2": (Vo2Options, generate_vo2),
}
"""One line a plant: what it may be told, and who draws its cases."""


def generate(seed: int, folder: Path, plant: str = "oscillator", **overrides: Any) -> Any:
    """Write dataset.toml, model.toml (oscillator only; a vo2's comes from `rtctl identify`) and data files of this
    seed into `folder`; the truth (a Truth, of a vo2 a Vo2Truth) is only returned.

    `overrides` are the fields of Options, of a vo2 of Vo2Options.
    Raises ValueError for an unknown plant or effect, TypeError for an unknown
    override, RuntimeError where no draw of this seed makes the wanted effect.
    """
    if plant not in PLANTS:
        raise ValueError(f"no plant {plant!r}; there are {', '.join(PLANTS)}")
    options, draw = PLANTS[plant]
    return draw(seed, Path(folder), options(**overrides))
