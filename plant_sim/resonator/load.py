"""A resonator of a device file, of the kind that the file describes."""

from __future__ import annotations

from pathlib import Path

from plant_sim.plant import Plant
from plant_sim.resonator.device_file import read_me_device
from plant_sim.resonator.plant import MeResonator
from rtctl.border.units.quantities import read_toml


def load_plant(path: Path, seed: int | None = None) -> Plant:
    """Return the device in the file, or the beam of a model that it names, on a bench with a lock-in.

    `seed` replaces that of its noise. Raises InputError with file and key.
    """
    plant = read_toml(path).get("plant")
    if isinstance(plant, dict) and "model" in plant:
        from plant_sim.resonator.lock_in_bench import load_bench

        return load_bench(path, seed)
    return MeResonator(read_me_device(path), seed)
