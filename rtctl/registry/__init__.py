"""Registration of plants, drivers, estimators, controllers and mechanisms, also from outside of the program."""

from rtctl.registry.builtin import DEFAULT_PLANT
from rtctl.registry.parts import (
    PARTS,
    Entry,
    Part,
    entries,
    find,
    forgetting,
    load,
    load_plugin,
    mechanisms_of,
    names,
    plant_kind,
    plant_kinds,
    register,
)
from rtctl.registry.plant_kind import (
    Control,
    Defaults,
    Identification,
    ModelFiles,
    PlantKind,
    SignalKind,
)

__all__ = [
    "DEFAULT_PLANT",
    "PARTS",
    "Control",
    "Defaults",
    "Entry",
    "Identification",
    "ModelFiles",
    "Part",
    "PlantKind",
    "SignalKind",
    "entries",
    "find",
    "forgetting",
    "load",
    "load_plugin",
    "mechanisms_of",
    "names",
    "plant_kind",
    "plant_kinds",
    "register",
]
