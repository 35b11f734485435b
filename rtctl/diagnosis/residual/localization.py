"""Where the gap lives: the share of the residual that forces along one coordinate would remove."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

LEAST_SHARE = 0.01


class Place(NamedTuple):
    """A coordinate and the share of the residual, beyond the noise, that lives along it."""

    coordinate: str
    share: float
    forces: tuple[str, ...]


def places(examined: TestedHypothesis) -> list[Place]:
    """Largest share first; shares overlap, since coordinates do."""
    by_coordinate: dict[str, list[int]] = {}
    for k, direction in enumerate(examined.directions):
        if not direction.mechanism and direction.coordinate != "memory":
            by_coordinate.setdefault(direction.coordinate, []).append(k)
    projected = examined.projected
    beyond = projected.residual - (projected.samples - projected.rank)
    if not beyond > 0.0:
        return []
    found = []
    for coordinate, indices in by_coordinate.items():
        removed, freedom = projected.block(np.array(indices))
        share = float(np.clip((removed - freedom) / beyond, 0.0, 1.0))
        if share > LEAST_SHARE:
            names = tuple(examined.directions[k].name for k in indices)
            found.append(Place(coordinate, share, names))
    return sorted(found, key=lambda place: -place.share)
