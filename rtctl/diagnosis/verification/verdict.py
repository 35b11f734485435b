"""What may be said: adequate, explained, partly explained, unexplained."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rtctl.diagnosis.search.stepwise import NEARLY, SearchResult
from rtctl.diagnosis.verification.holdout_error import Gain

DISSIPATION = {"damping.nonlinear", "damping.quadratic", "friction.coulomb", "hysteresis.bouc_wen"}
LEAST_GAIN = 1.5
"""Times less error on records that no fit saw: a part that is explained and gains less there, or by chance, is not
named."""
QUIET = 1.1
"""Times noise and allowance: a nominal model that misses test records by less misses nothing."""
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


def doubtful(search: SearchResult, allowed: bool) -> bool:
    """Whether a set passes the gate and leaves half of the squares: where a misfit is `allowed`, and noise may be as
    slow as that, passing says little of what was removed.
    """
    left = search.chosen.hypothesis.cost / search.nominal.hypothesis.cost
    return allowed and search.passes and left > 1.0 - HALF


def confirmed(
    verdict: str,
    causes: Sequence[str],
    gains: Sequence[Gain | None],
    *,
    doubted: bool = False,
    correction: bool = False,
    allowed: Mapping[str, float] | None = None,
) -> str:
    """`verdict`, once the test records were simulated: a part that is explained, or a whole that is `doubted`, must be
    so on them too, in one of the outputs at least (what ails a sensor shows in its own alone).

    Nor is a part explained by two laws of dissipation that leave something: together they imitate a third. Where
    what is doubted is no gain, and the nominal model misses the test records by noise and what is `allowed` (mean
    square, by output), nothing is wrong that they show; nor where it is a `correction` of what was identified alone,
    which left that much.
    """
    if verdict != "partly_explained" and not (verdict == "explained" and doubted):
        return verdict
    measured = [one for one in gains if one is not None]
    held = not measured or any(one.ratio > LEAST_GAIN and one.ratio_low > 1.0 for one in measured)
    imitated = verdict == "partly_explained" and len(DISSIPATION & set(causes)) > 1
    if held and not imitated:
        return verdict
    nothing = correction or all(_quiet(one, allowed or {}) for one in measured)
    return "adequate" if doubted and nothing else "unexplained"


def _quiet(one: Gain, allowed: Mapping[str, float]) -> bool:
    return one.before < QUIET * math.hypot(one.noise_floor, math.sqrt(allowed.get(one.output, 0.0)))
