"""What may be said: adequate, explained, partly explained, unexplained."""

from __future__ import annotations

from rtctl.diagnosis.search import Search


def verdict_of(search: Search, least_removed: float) -> str:
    """By the gate; where nothing passes, by whether the best set removes `least_removed` of the squared misfit."""
    if search.passes:
        return "adequate" if search.chosen is search.nominal else "explained"
    nominal, best = search.nominal.hypothesis.cost, search.chosen.hypothesis.cost
    return "partly_explained" if best < (1.0 - least_removed) * nominal else "unexplained"
