"""What a search alone claims: adequate, explained, partly explained, unexplained; test records have their say later."""

from __future__ import annotations

from rtctl.diagnosis.search.stepwise import NEARLY, SearchResult

LEAST_GAIN = 1.5
"""Times less error on records that no fit saw: a part that is explained and gains less there, or by chance, is not
named."""
HALF = 1.0 - 1.0 / LEAST_GAIN**2
"""Of the squares: what the least gain on test records comes to."""


def verdict_of(search: SearchResult, least_removed: float) -> str:
    """By the gate; where nothing passes, by whether the best set removes `least_removed` of the squared misfit, or
    more than half of it and all but passes: noise is never quite the one that the gate assumes.
    """
    if search.passes:
        return "adequate" if search.chosen.hypothesis is search.nominal.hypothesis else "explained"
    nominal, best = search.nominal.hypothesis.cost, search.chosen.hypothesis.cost
    least = min(least_removed, HALF) if search.chosen.p_value > NEARLY else least_removed
    return "partly_explained" if best < (1.0 - least) * nominal else "unexplained"
