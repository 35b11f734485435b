"""Localization of the gap: the share of the residual that forces along one coordinate would remove."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.diagnosis.residual.directions import MEMORY
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis


class Location(NamedTuple):
    """A coordinate along which a part of the residual lives."""

    coordinate: str
    """Coordinate of the generic forces."""
    share: float
    """Share of the residual's squares beyond the noise that these forces remove."""
    forces: tuple[str, ...]
    """Names of the forces."""


def localize_residual(tested: TestedHypothesis, least_share: float) -> list[Location]:
    """Return the coordinates along which at least `least_share` of the residual lives, the largest share first.

    Shares overlap, since the forces along two coordinates do.
    """
    by_coordinate: dict[str, list[int]] = {}
    for k, direction in enumerate(tested.directions):
        if not direction.mechanism and direction.coordinate != MEMORY:
            by_coordinate.setdefault(direction.coordinate, []).append(k)
    projected = tested.projected
    beyond_noise = projected.residual - (projected.samples - projected.rank)
    if not beyond_noise > 0.0:
        return []
    locations = []
    for coordinate, indices in by_coordinate.items():
        removed, rank = projected.block(np.array(indices))
        share = float(np.clip((removed - rank) / beyond_noise, 0.0, 1.0))
        if share > least_share:
            names = tuple(tested.directions[k].name for k in indices)
            locations.append(Location(coordinate, share, names))
    return sorted(locations, key=lambda location: -location.share)
