"""Whether a partial or doubtful explanation also reduces the error on records that took no part in a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.diagnosis.search.static_loops.hysteresis_refit import share_in_staircases
from rtctl.diagnosis.thresholds import Thresholds, VerificationThresholds
from rtctl.diagnosis.verification.verdict import Verdict

NOT_CONFIRMED = (
    "{} would reduce the error on the fitted records, but it does not reduce it on the test records by a factor of "
    "{:.3g}: it is not named"
)
IDENTIFICATION_RESIDUAL = (
    "{} would remove less than half of the residual, and nothing on the test records: this is what the identification "
    "of the static loops left, and no cause; longer staircases, or more --cells, leave less"
)
LOOPS_ALONE = (
    "static loops that are learned anew from the staircases and the fitted records leave no more than noise. The "
    "staircases themselves show only {:.1%} of the error: the rest lies between their levels, where the identification "
    "measured nothing, and is no cause; longer staircases, or more --cells, leave less"
)
LOOPS_IMITATE = (
    "static loops that are learned anew from the staircases and the fitted records lower the error on the test "
    "records, but the staircases themselves show only {:.1%} of it: such loops imitate what is missing, so "
    "hysteresis.shape is not named"
)


def added_mechanisms(search: SearchResult) -> tuple[str, ...]:
    """Return the ids of the chosen set that the nominal model does not have."""
    return search.chosen.hypothesis.mechanisms[len(search.nominal.hypothesis.mechanisms) :]


def judge_search(search: SearchResult, problem: Problem) -> Verdict:
    """Return the verdict that the search alone supports.

    Loops that were refitted behind no cause may imitate one: they are one where the staircases show enough of it.
    """
    if search.hysteresis_refit is not None:  # a refit is only kept where it reduces the error on test records
        verdict = Verdict(claim="explained" if search.passes else "partly_explained")
        share = share_in_staircases(search, problem)
        if added_mechanisms(search) or share >= problem.thresholds.search.small_set_share:
            return verdict
        claim = "adequate" if search.passes else "unexplained"
        return verdict.changed_to(claim, (LOOPS_ALONE if search.passes else LOOPS_IMITATE).format(share))
    return Verdict(
        claim=classify_outcome(search, problem.subject.least_share_removed, problem.thresholds.search)
    )


def require_holdout_gain(
    verdict: Verdict,
    search: SearchResult,
    problem: Problem,
    gains: Sequence[Gain | None],
    whitened: Sequence[Gain | None] = (),
) -> Verdict:
    """Withdraw a claim that does not also reduce the error on test records.

    Args:
        verdict: What the search alone supports.
        search: What was found.
        problem: Records that were fitted.
        gains: Of each output that all test records have; None without test records.
        whitened: The same of errors in units of the noise. A fast effect beside the slow error of a static model shows
            in these alone, and is confirmed where it takes most of what they show beyond the noise.
    """
    if search.hysteresis_refit is not None:
        return verdict
    added = added_mechanisms(search)
    doubted = bool(added) and is_doubtful(
        search, bool(problem.allowed), problem.thresholds.search.removed_share
    )
    mechanisms = {one.id: one for one in search.chosen.hypothesis.simulation.mechanisms}
    correction = all(mechanisms[name].of_identification for name in added)
    claim = confirmed_claim(
        verdict.claim, gains, problem.thresholds,
        doubted=doubted, correction=correction, allowed=problem.allowed,
    )  # fmt: skip
    if claim == verdict.claim:
        return verdict
    search_limits = problem.thresholds.search
    shown = any(
        one is not None
        and one.ratio_low > search_limits.whitened_gain
        and one.falls_to(search_limits.least_holdout_gain)
        for one in whitened
    )
    if shown and verdict.claim == "explained" and not correction and _leaves_allowed(search, problem, gains):
        return verdict
    names = ", ".join(added)
    if claim == "adequate" and correction:
        return verdict.changed_to(claim, IDENTIFICATION_RESIDUAL.format(names))
    return verdict.changed_to(
        claim, NOT_CONFIRMED.format(names, problem.thresholds.search.least_holdout_gain)
    )


def _leaves_allowed(search: SearchResult, problem: Problem, gains: Sequence[Gain | None]) -> bool:
    """Return whether the errors on test records are what innovations of the noise and the allowed misfit leave.

    The noise itself may have taken up what is missing: a slow part of it says nothing.
    """
    outputs, limits = search.chosen.hypothesis.sensitivity.outputs, problem.thresholds.verification
    for gain in gains:
        if gain is not None:
            noise = search.chosen.noise[outputs.index(gain.output)]
            expected = math.sqrt(noise.variance + problem.allowed.get(gain.output, 0.0))
            if not gain.after < limits.innovation_ratio * expected:
                return False
    return True


def is_doubtful(search: SearchResult, allowed: bool, removed_share: float) -> bool:
    """Return whether a set passes the residual tests although it does not remove `removed_share` of the squares.

    Where a misfit is `allowed`, and noise may be as slow as that misfit, passing says little of what was removed.
    """
    remaining = search.chosen.hypothesis.cost / search.nominal.hypothesis.cost
    return allowed and search.passes and remaining > 1.0 - removed_share


def confirmed_claim(
    claim: str,
    gains: Sequence[Gain | None],
    thresholds: Thresholds | None = None,
    *,
    doubted: bool = False,
    correction: bool = False,
    allowed: Mapping[str, float] | None = None,
) -> str:
    """Return the claim that the test records leave.

    A part of an explanation, or a doubted whole, must reduce the error on them too, of one output at least: what acts
    in a sensor shows in its own reading alone. Of a doubted set, which leaves no more than noise and the allowed
    misfit, the error beyond these counts: no cause lowers an error of 10 % to less than the 6 % that loops may be off
    by. A doubted set without gain is "adequate" where the nominal model misses the test records by no more than noise
    and the allowed misfit, or where it is a correction of the identified part.

    Args:
        claim: What the search alone supports.
        gains: Of each output that all test records have; None without test records.
        thresholds: Thresholds of search and verification.
        doubted: Whether a set that passes is in doubt.
        correction: Whether the set only corrects what was identified of the model.
        allowed: Mean square of the allowed misfit, by output.
    """
    if claim != "partly_explained" and not (claim == "explained" and doubted):
        return claim
    limits = thresholds or Thresholds()
    measured = [one for one in gains if one is not None]
    least = limits.search.least_holdout_gain
    squares = allowed or {}
    certain = [one for one in measured if one.ratio_low > 1.0]
    if not measured or any(one.ratio > least for one in certain):
        return claim
    if doubted and any(one.falls_to(least, squares.get(one.output, 0.0)) for one in certain):
        return claim
    misses_nothing = correction or all(_is_quiet(one, squares, limits.verification) for one in measured)
    return "adequate" if doubted and misses_nothing else "unexplained"


def _is_quiet(gain: Gain, allowed: Mapping[str, float], thresholds: VerificationThresholds) -> bool:
    """Return whether the nominal model misses the test records by no more than noise and the allowed misfit."""
    expected = math.hypot(gain.noise_floor, math.sqrt(allowed.get(gain.output, 0.0)))
    return gain.before < thresholds.quiet_ratio * expected
