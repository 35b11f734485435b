"""What may be said: adequate, explained, partly explained, unexplained."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.thresholds import SearchThresholds

LIMITS = SearchThresholds()

DISSIPATION = {"damping.nonlinear", "damping.quadratic", "friction.coulomb", "hysteresis.bouc_wen"}
QUIET = 1.1
"""Times noise and allowance: a nominal model that misses test records by less misses nothing."""


def doubtful(search: SearchResult, allowed: bool) -> bool:
    """Whether a set passes the gate and leaves half of the squares: where a misfit is `allowed`, and noise may be as
    slow as that, passing says little of what was removed.
    """
    left = search.chosen.hypothesis.cost / search.nominal.hypothesis.cost
    return allowed and search.passes and left > 1.0 - LIMITS.removed_share


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
    held = not measured or any(
        one.ratio > LIMITS.least_holdout_gain and one.ratio_low > 1.0 for one in measured
    )
    imitated = verdict == "partly_explained" and len(DISSIPATION & set(causes)) > 1
    if held and not imitated:
        return verdict
    nothing = correction or all(_quiet(one, allowed or {}) for one in measured)
    return "adequate" if doubted and nothing else "unexplained"


def _quiet(one: Gain, allowed: Mapping[str, float]) -> bool:
    return one.before < QUIET * math.hypot(one.noise_floor, math.sqrt(allowed.get(one.output, 0.0)))
