"""Shares of the squared error that the causes of a set remove, from the costs of all sets that were fitted.

Sequential shares in the order of what each adds: W. Kruskal, Relative importance by averaging over orderings, The
American Statistician 41 (1987), has the mean over all orders, for which most of the sets would have to be fitted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.search.outcome import SearchResult


def shares_that_return(search: SearchResult) -> dict[str, float]:
    """Return the fraction of the squares beyond the noise that comes back without each cause of the chosen set."""
    chosen, costs = search.chosen.hypothesis, _costs_by_set(search)
    names = frozenset(chosen.mechanisms) - set(search.nominal.hypothesis.mechanisms)
    nominal = search.nominal.hypothesis.cost
    back = {name: costs.get(names - {name}, nominal) - chosen.cost for name in names}
    return _as_shares(back, search)


def sequential_shares(search: SearchResult) -> dict[str, float]:
    """Return the fraction of the squares beyond the noise that each cause of the chosen set removes, largest first.

    A cause is counted beside those that remove more, so that the shares add up to what the set removes, and causes that
    could nearly replace one another do not all count as nothing. The last one is that without which least comes back,
    and so on; where sets of the rest were not fitted, they share what is left equally.
    """
    costs = _costs_by_set(search)
    rest = frozenset(search.chosen.hypothesis.mechanisms) - set(search.nominal.hypothesis.mechanisms)
    cost = search.chosen.hypothesis.cost
    removed: dict[str, float] = {}
    while rest:
        known = {name: costs[rest - {name}] for name in sorted(rest) if rest - {name} in costs}
        if not known:
            left = search.nominal.hypothesis.cost - cost
            removed |= dict.fromkeys(rest, left / len(rest))
            break
        last = min(known, key=lambda name: known[name])
        removed[last] = known[last] - cost
        rest, cost = rest - {last}, known[last]
    return _as_shares(removed, search)


def _costs_by_set(search: SearchResult) -> dict[frozenset[str], float]:
    """Return the lowest cost of every set that was fitted, by the mechanisms that it adds."""
    nominal = search.nominal.hypothesis
    own, costs = set(nominal.mechanisms), {frozenset[str](): nominal.cost}
    for one in (*search.hypotheses, *search.leave_one_out):
        names = frozenset(one.mechanisms) - own
        costs[names] = min(one.cost, costs.get(names, math.inf))
    return costs


def _as_shares(removed: Mapping[str, float], search: SearchResult) -> dict[str, float]:
    """Return squares that are removed as fractions of those beyond the noise."""
    removable = search.nominal.hypothesis.cost - noise_cost_of(search.chosen)
    if not removable > 0.0:
        return dict.fromkeys(removed, 0.0)
    return {name: float(np.clip(one / removable, 0.0, 1.0)) for name, one in removed.items()}
