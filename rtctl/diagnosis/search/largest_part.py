"""Where no set explains the data: the single cause that, on the test records, certainly removes most of the error.

No device is exactly a model with one cause more. What a person needs then is the largest part by its name, with its
share and with what remains, as far as records that no fit saw bear it out.
"""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.holdout_error import certainly_falls, measure_gains
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.identification.fit_record import FitRecord


def choose_largest_part(
    result: SearchResult, problem: Problem, tests: Sequence[FitRecord], ids: Sequence[str]
) -> SearchResult:
    """Return the outcome with the largest part as its chosen set; as it is where a set explains, or where no part does.

    Loops that were refitted stay with the set behind which they were.

    Args:
        result: Outcome of a search.
        problem: Records that were fitted.
        tests: Records that took no part in a fit.
        ids: Mechanisms of the catalogue that are tested.
    """
    limits = problem.thresholds.search
    claim = classify_outcome(result, problem.subject.least_share_removed, limits)
    has_singles = bool(result.rankings and result.rankings[0])
    if claim != "unexplained" or not (tests and has_singles) or result.hysteresis_refit is not None:
        return result
    singles = sorted((one.hypothesis for one in result.rankings[0]), key=lambda one: one.cost)
    part, *others = singles
    if not _lowers(result.nominal.hypothesis, part, limits.least_holdout_gain, result, problem, tests):
        return result
    near = [one for one in others if one.cost < limits.equivalent_cost * part.cost]
    rivals = tuple(one for one in near if not _lowers(one, part, 1.0, result, problem, tests))
    if len(rivals) > limits.most_part_rivals:
        return result
    return result._replace(
        chosen=run_residual_tests(part, problem, ids),
        equivalent=rivals,
        leave_one_out=(result.nominal.hypothesis,),
        is_part=True,
    )


def _lowers(
    before: Hypothesis,
    after: Hypothesis,
    least: float,
    result: SearchResult,
    problem: Problem,
    tests: Sequence[FitRecord],
) -> bool:
    """Return whether on test records an output's error certainly falls by `least` times, and none certainly rises."""
    return certainly_falls(
        measure_gains(before, result.chosen._replace(hypothesis=after), problem, tests), least
    )
