"""What may be said: adequate, explained, partly explained, unexplained."""

from __future__ import annotations

from rtctl.diagnosis.search import Search

PARTLY = 0.9
"""Of the squared misfit of the re-fitted nominal model: causes that remove less of it are not named."""


def verdict_of(search: Search, noise_cost: float) -> str:
    """By the gate; and by what the best set removes where nothing passes."""
    if search.passes:
        return "adequate" if search.chosen is search.nominal else "explained"
    nominal, best = search.nominal.hypothesis.cost, search.chosen.hypothesis.cost
    return "partly_explained" if best < (1.0 - PARTLY) * nominal else "unexplained"
