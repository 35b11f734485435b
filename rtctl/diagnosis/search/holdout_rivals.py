"""Rival sets that fit about as well, and that the test records do not tell from the chosen one.

Where a model may be off by more than the noise, a likelihood in that noise tells sets apart that differ in nothing but
which part of the model's own error they take up. Records that no fit saw decide: a set whose error there is not
certainly larger, in any output, as it is or in units of the noise, is as good an explanation.
"""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.holdout_error import ScoredOutput, measure_gain
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.identification.fit_record import FitRecord


def add_untold_rivals(result: SearchResult, problem: Problem, tests: Sequence[FitRecord]) -> SearchResult:
    """Return the outcome with the rivals of its chosen set that the test records do not tell from it.

    Args:
        result: Outcome of a search.
        problem: Records that were fitted; nothing changes where it allows no misfit.
        tests: Records that took no part in a fit.
    """
    size = len(result.chosen.hypothesis.mechanisms) - len(result.nominal.hypothesis.mechanisms)
    if not (problem.allowed and tests and result.passes and 0 < size <= len(result.rankings)):
        return result
    ranking = [one.hypothesis for one in result.rankings[size - 1]]
    names = set(result.chosen.hypothesis.mechanisms)
    own = next((one for one in ranking if set(one.mechanisms) == names), None)
    if own is None:
        return result
    known = [names, *(set(one.mechanisms) for one in result.equivalent)]
    most = problem.thresholds.search.untold_cost * own.cost
    untold = [
        one
        for one in ranking
        if set(one.mechanisms) not in known
        and one.cost < most
        and not _is_told_apart(result, own, one, problem, tests)
    ]
    return result._replace(equivalent=(*result.equivalent, *untold)) if untold else result


def _is_told_apart(
    result: SearchResult, own: Hypothesis, rival: Hypothesis, problem: Problem, tests: Sequence[FitRecord]
) -> bool:
    """Return whether an output's error on test records is certainly smaller with `own` than with `rival`."""
    for name, noise in zip(result.chosen.hypothesis.sensitivity.outputs, result.chosen.noise, strict=True):
        seen = [one for one in tests if name in one.measured]
        for output in (ScoredOutput(name, "", 1.0), ScoredOutput(name, "", 1.0, noise)):
            gain = measure_gain(
                rival.simulation, own.simulation, seen, output, problem.scales.rate, problem.thresholds.search
            )
            if gain is not None and gain.ratio_low > 1.0:
                return True
    return False
