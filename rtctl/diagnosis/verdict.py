"""What may be said: adequate, explained, partly explained, unexplained."""

from __future__ import annotations

import math

from rtctl.diagnosis.gate import Examined
from rtctl.diagnosis.search import Search

PARTLY = 0.9
"""Of the squared misfit of the re-fitted nominal model: causes that remove less of it are not named."""


def verdict_of(search: Search, noise_cost: float) -> str:
    """By the gate; and by what the best set removes where nothing passes."""
    if search.passes:
        return "adequate" if search.chosen is search.nominal else "explained"
    nominal, best = search.nominal.hypothesis.cost, search.chosen.hypothesis.cost
    return "partly_explained" if best < (1.0 - PARTLY) * nominal else "unexplained"


def noise_cost_of(examined: Examined) -> float:
    """Half the sum of squares that noise alone would leave, on the scale of the fits' cost."""
    projected = examined.projected
    excess = projected.residual / max(projected.samples - projected.rank, 1)
    return examined.hypothesis.cost / max(excess, 1.0)


def left_over_noise(examined: Examined) -> float:
    """RMS of what is left over that of noise alone: 1 where the set explains all of it."""
    return math.sqrt(examined.hypothesis.cost / noise_cost_of(examined)) if examined.hypothesis.cost else 1.0
