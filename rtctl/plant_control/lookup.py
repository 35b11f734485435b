"""The support of a kind of plant by its name."""

from __future__ import annotations

from typing import Any

from rtctl.plant_control.support import PlantSupport
from rtctl.registry import plant_kind


def support_of(kind: str) -> PlantSupport[Any]:
    """Return how a kind of plant is controlled: its own support, or the one of plants without a model.

    Raises:
        InputError: there is no such kind of plant.
    """
    record = plant_kind(kind)
    if record.control is None:
        from rtctl.plant_control.without_model import WithoutModel

        return WithoutModel(record)
    support = record.part(record.control.support)
    made: PlantSupport[Any] = support() if isinstance(support, type) else support
    return made
