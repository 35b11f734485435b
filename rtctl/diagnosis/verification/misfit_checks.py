"""Checks of the final model: it must follow the signals, and the test records must not contradict it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.thresholds import VerificationThresholds
from rtctl.diagnosis.verification.holdout_gain import added_mechanisms
from rtctl.diagnosis.verification.holdout_residual import explain_holdout_residual
from rtctl.diagnosis.verification.verdict import Verdict
from rtctl.identification.fit_record import FitRecord

LOWER = {"adequate": "unexplained", "explained": "partly_explained"}
FOLLOWS_LITTLE = (
    "the re-fitted model leaves {:.0%} of the signal's RMS. Noise of the same colour cannot be told from that, but a "
    "model that follows nothing is not adequate: does the drive in the file reach the device, are its column, units "
    "and signs right, does the model have all of its parameters?"
)

EXPLAINS_LITTLE = (
    "with the causes the model leaves {:.0%} of the signal's RMS. Noise of the same colour cannot be told from that, "
    "but causes that leave nearly all of the signal explain nothing: does the drive in the file reach the device, are "
    "its column, units and signs right?"
)

PART_FOLLOWS_LITTLE = (
    "{} would remove most of the error, but with {} the model still leaves {:.0%} of the motion (RMS). A model follows "
    "a device of another kind that little, and what comes nearest in it is no cause: nothing is named"
)


def require_part_follows(
    verdict: Verdict, search: SearchResult, problem: Problem, error: Gain | None, tests: Sequence[FitRecord]
) -> Verdict:
    """Withdraw causes that are a part of the explanation where the model leaves much of the motion even with them.

    What is left counts as motion where earlier samples predict it; else it is noise.

    Args:
        verdict: What is claimed so far.
        search: What was found.
        problem: Records, or parts of them, that the chosen set was fitted to.
        error: Free-run errors on the test records; None without test records.
        tests: Test records.
    """
    limits = problem.thresholds.verification
    if verdict.claim != "partly_explained" or not _leaves_motion(search.chosen, limits):
        return verdict
    remaining = relative_misfit(problem, search.chosen.hypothesis)
    if error is not None:
        readings = [one.measured[error.output][one.first :] for one in tests if error.output in one.measured]
        size = float(np.std(np.concatenate(readings)))
        remaining = max(remaining, error.after / size if size > 0.0 else 0.0)
    if not remaining > limits.unfollowed_part:
        return verdict
    added = added_mechanisms(search)
    them = "it" if len(added) == 1 else "them"
    note = PART_FOLLOWS_LITTLE.format(" and ".join(added), them, remaining)
    return verdict.changed_to("unexplained", note)


def require_model_follows(verdict: Verdict, after: TestedHypothesis, problem: Problem) -> Verdict:
    """Withdraw "adequate" or "explained" from a model that leaves nearly all of the signal; `after` is its fit."""
    if verdict.claim not in LOWER:
        return verdict
    limits, remaining = problem.thresholds.verification, relative_misfit(problem, after.hypothesis)
    most = limits.unfollowed_motion if _leaves_motion(after, limits) else limits.unfollowed
    if not remaining > most:
        return verdict
    note = FOLLOWS_LITTLE if verdict.claim == "adequate" else EXPLAINS_LITTLE
    return verdict.changed_to("unexplained", note.format(remaining))


def require_holdout_residual(
    verdict: Verdict,
    error: Gain | None,
    after: TestedHypothesis,
    problem: Problem,
    tests: Sequence[FitRecord],
) -> Verdict:
    """Lower a claim that the test records contradict.

    Args:
        verdict: What is claimed so far.
        error: Free-run errors on the test records; None without test records.
        after: Fit of the final model to whole records.
        problem: Records that were fitted, whole.
        tests: Test records.
    """
    if verdict.claim not in LOWER or error is None:
        return verdict
    by_output = dict(zip(after.hypothesis.sensitivity.outputs, after.noise, strict=True))
    noise = by_output.get(error.output)
    finding = explain_holdout_residual(error, problem, tuple(tests), after.hypothesis, noise)
    if finding is None:
        return verdict
    if finding.is_gap:
        return verdict.changed_to(LOWER[verdict.claim], finding.note)
    return verdict.with_note(finding.note)


def _leaves_motion(tested: TestedHypothesis, thresholds: VerificationThresholds) -> bool:
    """Return whether earlier samples predict most of what is left of an output, so that it is motion and no noise."""
    unpredicted = 1.0 - thresholds.predictable_share
    return any(noise.variance < unpredicted * noise.mean_square for noise in tested.noise)
