"""Which kinds of plant there are, and the devices that come with the program: one line registers a kind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from plant_sim import vo2
from plant_sim.oscillator import plant as oscillator
from plant_sim.plant import Plant
from plant_sim.resonator import plant as me_resonator
from rtctl.border.errors import InputError, nearest
from rtctl.border.quantities import read_toml

KINDS: dict[str, Callable[[Path, int | None], Plant]] = {
    "vo2": vo2.load_plant,
    "me": me_resonator.load_plant,
    "oscillator": oscillator.load_plant,
}


def load_plant(path: Path, seed: int | None = None) -> Plant:
    """The plant in the file, by its `[plant] kind`, or a model's by `[model] kind`.

    `seed` replaces that of its noise. Raises InputError.
    """
    tables = read_toml(path)
    plant, model = tables.get("plant"), tables.get("model")
    kind = plant.get("kind") if isinstance(plant, dict) else None
    if plant is None and isinstance(model, dict) and model.get("kind") == "oscillator":
        kind = "oscillator"
    if kind is None:
        raise InputError(f'{path}: key "plant.kind" is missing{nearest("", KINDS)}')
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f'{path}: key "plant.kind": unknown kind {kind!r}{nearest(str(kind), KINDS)}')
    return KINDS[kind](path, seed)


def bundled_plant(name: str) -> Path:
    """The file of a device that comes with the program, such as "vo2_a". Raises InputError."""
    devices = {path.stem: path for path in Path(__file__).parent.glob("*/devices/*.toml")}
    if name not in devices:
        raise InputError(f'no bundled plant "{name}"{nearest(name, devices)}')
    return devices[name]
