"""The verification: what the search claims, tested by all that could contradict it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.verification.holdout_gain import judge_search, require_holdout_gain
from rtctl.diagnosis.verification.misfit_checks import (
    require_holdout_residual,
    require_model_follows,
    require_part_follows,
)
from rtctl.diagnosis.verification.nonparametric_comparison import compare_nonparametric
from rtctl.diagnosis.verification.verdict import Verdict
from rtctl.diagnosis.verification.whole_record_fits import Fits, HoldoutData


class Verified(NamedTuple):
    """The final verdict, with the fits that it stands on."""

    verdict: Verdict
    fits: Fits
    """The nominal model twice where no cause is named."""
    gain: Gain | None
    """Gain of the subject's output; None without test records."""
    helps: bool
    """Whether on test records the error of another output, or that of any in units of the noise, certainly falls, and
    none certainly rises."""


def verify(
    search: SearchResult, request: SearchRequest, fits: Fits, holdout: HoldoutData, *, uncut: bool
) -> Verified:
    """Test what the search claims, step by step; each step may lower the verdict and says why.

    Args:
        search: What was found.
        request: Records, budget and options of the search.
        fits: The nominal model and the chosen set, fitted to whole records.
        holdout: Test records, and what errors on them are computed with.
        uncut: Whether the search used whole records; else only the test records show what comes after their parts.
    """
    problem = request.problem
    gains = [holdout.gain_of(fits, name) for name in holdout.outputs]

    verdict = judge_search(search, problem)
    asked = verdict.names_causes and problem.allowed
    whitened = [holdout.whitened_gain_of(fits, name) for name in holdout.outputs] if asked else []
    verdict = require_holdout_gain(verdict, search, problem, gains, whitened)
    verdict = compare_nonparametric(verdict, search, problem, request.budget, request.report)
    of_output = next((one for one in gains if one is not None and one.output == problem.subject.output), None)
    verdict = require_part_follows(verdict, search, problem, of_output, holdout.tests)
    verdict = require_model_follows(verdict, fits.after if verdict.names_causes else fits.before, problem)
    if not verdict.names_causes:
        fits = Fits(fits.before, fits.before)
    final_gain = holdout.gain_of(fits, problem.subject.output)
    if uncut or verdict.claim == "explained":
        verdict = require_holdout_residual(verdict, final_gain, fits.after, problem, holdout.tests)
    return Verified(
        verdict,
        fits,
        final_gain,
        helps=verdict.names_causes and falls_elsewhere(gains, whitened, problem.subject.output),
    )


def falls_elsewhere(gains: Sequence[Gain | None], whitened: Sequence[Gain | None], output: str) -> bool:
    """Return whether an error other than that of `output` certainly falls, and none certainly rises."""
    plain, white = ([one for one in several if one is not None] for several in (gains, whitened))
    others = [*(one for one in plain if one.output != output), *white]
    return any(one.ratio_low > 1.0 for one in others) and all(
        one.ratio_high >= 1.0 for one in (*plain, *white)
    )
