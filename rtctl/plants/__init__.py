"""What the loop's surroundings ask of a kind of plant and its model; a new kind is one file and one line here."""

from __future__ import annotations

from typing import Any

from rtctl.border.errors import InputError
from rtctl.plants.me.control import MeSupport
from rtctl.plants.support import PlantSupport
from rtctl.plants.vo2.control import Vo2Support

SUPPORT: dict[str, PlantSupport[Any]] = {
    "vo2": Vo2Support(),
    "me": MeSupport(),
}


def support_of(kind: str) -> PlantSupport[Any]:
    """By `scenario.plant`. Raises InputError for a plant that has a profile, but nothing to control it with."""
    if kind not in SUPPORT:
        raise InputError(
            f'key "scenario.plant": nothing here controls a plant "{kind}"; those are: {", ".join(SUPPORT)}'
        )
    return SUPPORT[kind]
