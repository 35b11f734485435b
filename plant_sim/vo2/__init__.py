"""VO2 microactuators: a cantilever that bends and a film that senses, both by one phase transition."""

from __future__ import annotations

from pathlib import Path

from plant_sim.plant import Plant
from plant_sim.vo2.device_file import read_device
from plant_sim.vo2.plant import Vo2Plant

__all__ = ["Vo2Plant", "load_plant"]


def load_plant(path: Path, seed: int | None = None) -> Plant:
    """Return the device in the file; `seed` replaces that of its noise. Raises InputError with file and key."""
    return Vo2Plant(read_device(path), seed)
