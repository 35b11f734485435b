"""What of a verdict stands once all records have had their say."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.nominal_fit.multiple_shooting_start import misfit
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.verification.holdout_residual import unseen
from rtctl.identification.fit_record import FitRecord

FOLLOWS_LITTLE = 0.7
"""Of the signals' RMS about their means: a model that leaves more follows little, if what it leaves is motion."""
FOLLOWS_NOTHING = 0.99
"""The same, whatever is left."""
MOTION = 0.5
"""Of the square of what is left: what the samples before foretell of the next one, if it is more, is motion."""
LOWER = {"adequate": "unexplained", "explained": "partly_explained"}
LITTLE = (
    "the model, re-fitted, leaves {:.0%} of the signal's RMS. Noise of the same colour cannot be told from that, but a "
    "model that follows nothing is not adequate: does the drive in the file reach the device, are its column, units "
    "and signs right, does the model have all of its parameters?"
)


def held(
    verdict: str,
    final: Gain | None,
    after: TestedHypothesis,
    problem: Problem,
    tests: Sequence[FitRecord],
    *,
    uncut: bool,
) -> tuple[str, list[str]]:
    """`verdict` or a lower one, and why.

    A model that follows nothing is not adequate, and nothing is explained that test records contradict, whose error is
    `final`; they judge only where `data` are whole records, `uncut`.
    """
    if verdict not in LOWER:
        return verdict, []
    left = misfit(problem, after.hypothesis)
    if verdict == "adequate" and left > (FOLLOWS_LITTLE if _is_motion(after) else FOLLOWS_NOTHING):
        return LOWER[verdict], [LITTLE.format(left)]
    beyond = unseen(final, problem, tuple(tests), after.hypothesis) if final is not None and uncut else None
    if beyond is None:
        return verdict, []
    return LOWER[verdict] if beyond.is_gap else verdict, [beyond.said]


def _is_motion(examined: TestedHypothesis) -> bool:
    """Whether most of what is left of any output is foretold by the samples before."""
    return any(one.variance < (1.0 - MOTION) * one.mean_square for one in examined.noise)
