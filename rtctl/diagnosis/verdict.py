"""What may be said: adequate, explained, partly explained, unexplained."""

from __future__ import annotations

from rtctl.diagnosis.search import Search

PARTLY = 0.8
"""Share of the removable error that the best causes must remove where something else is left as well."""


def verdict_of(search: Search, noise_cost: float) -> str:
    """By the gate; and by what the best set removes where nothing passes."""
    if search.passes:
        return "explained" if search.chosen.hypothesis.mechanisms else "adequate"
    nominal, best = search.nominal.hypothesis.cost, search.chosen.hypothesis.cost
    removable = nominal - noise_cost
    if removable > 0.0 and (nominal - best) / removable > PARTLY:
        return "partly_explained"
    return "unexplained"
