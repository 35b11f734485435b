"""Causes that test records refute: the search is repeated without them, while there is work left for it.

A decay shows one course of time. A spring that changes with time fits it as well as one that changes with amplitude,
but not another decay, which begins elsewhere. Test records take such a cause away; which one comes in its place the
fitted records say.
"""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.first_samples import run_search_tests
from rtctl.diagnosis.search.catalogue_search import search_again
from rtctl.diagnosis.search.holdout_error import measure_gains
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.diagnosis.search.request import FoundCauses, SearchRequest
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.identification.fit_record import FitRecord

REPEATED = (
    "{} fits the records to fit best and does not lower the error on the test records, so the search was repeated "
    "without it"
)


def search_without_refuted(request: SearchRequest, found: FoundCauses) -> FoundCauses:
    """Return what a search of whole records finds without the causes that test records refute, if they bear that out.

    Args:
        request: What the search needs.
        found: What it has found.
    """
    if found.cancelled:
        return found
    request = request._replace(tests=found.tests)
    least, refuted, again = request.problem.thresholds.search.least_holdout_gain, [], found
    for _ in range(request.problem.thresholds.search.refuted_causes):
        first = _find_refuted(request, again.result)
        if first is None or request.budget.spent:
            break
        refuted.append(first)
        request = request._replace(ids=tuple(one for one in request.ids if one not in refuted))
        again = search_again(request)
        if again.cancelled:
            return found._replace(cancelled=True)
        if _gains(request.tests, again.result, request.problem, least):
            return again._replace(
                course=found.course,
                tests=found.tests,
                result=_tested_for_all(request, again.result, refuted),
                notes=[*again.notes, REPEATED.format(" and ".join(refuted))],
            )
    return found


def _find_refuted(request: SearchRequest, result: SearchResult) -> str | None:
    """Return the first cause of a set that is a part of the explanation and that no test record bears out."""
    problem, limits = request.problem, request.problem.thresholds.search
    claim = classify_outcome(result, problem.subject.least_share_removed, limits)
    if claim != "partly_explained" or result.hysteresis_refit is not None or not request.tests:
        return None
    if _gains(request.tests, result, problem, limits.least_holdout_gain):
        return None
    nominal = result.nominal.hypothesis.mechanisms
    return next(name for name in result.chosen.hypothesis.mechanisms if name not in nominal)


def _gains(tests: Sequence[FitRecord], result: SearchResult, problem: Problem, least: float) -> bool:
    """Return whether the error on test records of one output at least falls by the factor `least`."""
    gains = measure_gains(result.nominal.hypothesis, result.chosen, problem, tests)
    return any(one.ratio > least and one.ratio_low > 1.0 for one in gains)


def _tested_for_all(request: SearchRequest, result: SearchResult, refuted: Sequence[str]) -> SearchResult:
    """Return the outcome with its set tested for the causes that were left out as well."""
    problem = result.refined_problem or request.problem
    tested = run_search_tests(result.chosen.hypothesis, problem, (*request.ids, *refuted))
    level = significance_level(problem, request.options.false_claim_rate)
    return result._replace(chosen=tested, passes=result.passes and tested.p_value > level)
