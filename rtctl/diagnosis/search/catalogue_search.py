"""Search of the catalogue for causes, with a refit of the static loops where the identified ones are too coarse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rtctl.diagnosis.nominal_fit.predictability import cut_tests_of_another_course
from rtctl.diagnosis.problem.cancellation import CancelledError
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.elimination.dissipation import drop_imitating_dissipation
from rtctl.diagnosis.search.elimination.holdout_support import add_untold_rivals, drop_minor, drop_unsupported
from rtctl.diagnosis.search.holdout_error import compute_free_run_error, measure_gains
from rtctl.diagnosis.search.largest_part import choose_largest_part
from rtctl.diagnosis.search.nonparametric import find_better_alternative
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.diagnosis.search.request import FoundCauses, SearchRequest
from rtctl.diagnosis.search.sentences import (
    CUT_BY_CLOCK,
    FURTHER_NOT_SEARCHED,
    IMITATING,
    IMITATION_NOT_TRIED,
    LOOPS_NOT_CHECKED,
    LOOPS_NOT_REFITTED,
    MINOR,
    OUT_OF_WORK,
    STOPPED,
    UNSUPPORTED,
)
from rtctl.diagnosis.search.state import SearchSettings
from rtctl.diagnosis.search.static_loops.beside_correction import BesideCorrection
from rtctl.diagnosis.search.static_loops.hysteresis_refit import ID as HYSTERESIS_SHAPE
from rtctl.diagnosis.search.static_loops.hysteresis_refit import LoopRefitter, compute_error_over_noise
from rtctl.diagnosis.search.stepwise import search_stepwise, significance_level
from rtctl.identification.fit_record import FitRecord


def find_causes(request: SearchRequest, *, whole: bool) -> FoundCauses:
    """Search the catalogue for the causes of what the nominal model leaves.

    Where the static loops are too coarse, they are refitted behind what a first look finds. More causes are searched
    only where that does not help, since beside wrong loops a second cause explains their errors.

    Args:
        request: What the search needs.
        whole: Whether whole records are fitted; static loops are refitted to whole records only.
    """
    found = _search_first(request, whole=whole)
    course = ""
    if whole and not found.cancelled:
        request, course = _judge_by_pieces(request, found.result)
        found = found if _is_final(found) else _search_further(request, found)
        found = _add_causes_behind_loops(request, found)
    found = _judge_parts(request, found, whole=whole)
    return found._replace(course=course, tests=request.tests)


def _judge_parts(request: SearchRequest, found: FoundCauses, *, whole: bool) -> FoundCauses:
    """Return what was found without causes that may only take up a part of what is missing, beside its rivals."""
    problem, result = found.result.refined_problem or request.problem, found.result
    if whole:
        result = add_untold_rivals(result, problem, request.tests)
    if found.cancelled:
        return found._replace(result=result)
    try:
        result, others = drop_imitating_dissipation(
            result, problem, request.ids, request.budget, request.report
        )
    except CancelledError:
        return found._replace(result=result, cancelled=True, notes=[*found.notes, IMITATION_NOT_TRIED])
    result, minor = drop_minor(result, problem, request.tests, request.ids)
    dropped = [(IMITATING, others), (MINOR, minor)]
    notes = [
        *found.notes,
        *(text.format(" and ".join(names)) for text, names in dropped if names),
    ]
    return found._replace(
        result=choose_largest_part(result, problem, request.tests, request.ids), notes=notes
    )


def _search_first(request: SearchRequest, *, whole: bool) -> FoundCauses:
    """Search behind coarse loops, or with the loops as they are."""
    first = _look_behind_coarse_loops(request) if whole and request.tests else None
    if first is None or (first.result.out_of_time and not _is_final(first)):
        return _search(request, correct=whole)
    return first


def search_again(request: SearchRequest) -> FoundCauses:
    """Search whole records, and hold what is found to the test records."""
    found = _search(request, correct=True)
    found = found if _is_final(found) else _search_further(request, found)
    return _judge_parts(request, _add_causes_behind_loops(request, found), whole=True)


def _search_further(request: SearchRequest, first: FoundCauses) -> FoundCauses:
    """Hold what was found to the test records, then search behind loops that are off elsewhere."""
    finished = _finish_by_test_records(request, first)
    if first.behind_refitted_loops or _is_final(finished):
        return finished
    return _look_behind_loop_errors(request, finished)


def _add_causes_behind_loops(request: SearchRequest, found: FoundCauses) -> FoundCauses:
    """Search for further causes where the loops were refitted behind some and something is left."""
    refit = found.result.hysteresis_refit
    if found.cancelled or refit is None or not request.tests:
        return found
    try:
        return found._replace(result=request.loop_refitter(refit.coarse).add_causes(found.result))
    except CancelledError:
        return found._replace(cancelled=True, notes=[*found.notes, FURTHER_NOT_SEARCHED])


def _judge_by_pieces(request: SearchRequest, result: SearchResult) -> tuple[SearchRequest, str]:
    """Return the request with test records in pieces where free runs of what was found take another course."""
    problem = result.refined_problem or request.problem
    tests, note = cut_tests_of_another_course(problem, result.chosen.hypothesis, tuple(request.tests))
    return request._replace(tests=tests), note


def _is_final(found: FoundCauses) -> bool:
    return found.cancelled or found.result.hysteresis_refit is not None


def _look_behind_coarse_loops(request: SearchRequest) -> FoundCauses | None:
    """Search within a small budget and refit the static loops behind that; return None where they are fine enough.

    Where no other cause was seen beside the coarse loops, the catalogue is searched once more with the refitted ones.
    Loops alone are a cause only where the nominal model does not pass with the loops that it has.
    """
    try:
        refitter = _find_coarse_loops(request)
    except CancelledError:
        return None
    if refitter is None:
        return None
    first = _search(
        request._replace(budget=request.budget.further(request.budget.thresholds.first_look)), correct=False
    )
    if first.cancelled:
        return first
    try:
        refitted = refitter.refit_behind(first.result)
    except CancelledError:
        return FoundCauses(first.result, [LOOPS_NOT_CHECKED], cancelled=True)
    if refitted.hysteresis_refit is None:
        return first
    if refitted.chosen.hypothesis.mechanisms != refitted.nominal.hypothesis.mechanisms:
        return FoundCauses(refitted, [], cancelled=False)
    found = _search_behind_refitted_loops(request, refitted, refitter)
    is_alone = found.result.chosen.hypothesis.mechanisms == refitted.nominal.hypothesis.mechanisms
    if not is_alone or found.cancelled:
        return found
    if first.result.passes:
        return first._replace(behind_refitted_loops=True)
    return _refit_beside_each(request, first.result, found, refitter)


def _refit_beside_each(
    request: SearchRequest, first: SearchResult, found: FoundCauses, refitter: LoopRefitter
) -> FoundCauses:
    """Refit the loops behind each of the best single causes, where refitted loops alone would be the answer.

    A cause that was there when the loops were identified is in them: with the loops of the file it fits badly, and
    loops that are refitted without it take up its part.
    """
    names = request.nominal.mechanisms
    singles = [one.hypothesis for one in first.rankings[0]] if first.rankings else []
    rivals = [one for one in singles if set(one.mechanisms) - set(names) != {HYSTERESIS_SHAPE}]
    try:
        result = refitter.refit_behind_best(
            found.result, rivals[: request.problem.thresholds.search.refits_beside]
        )
    except CancelledError:
        return found._replace(cancelled=True, notes=[*found.notes, LOOPS_NOT_REFITTED])
    return found._replace(result=result)


def _look_behind_loop_errors(request: SearchRequest, found: FoundCauses) -> FoundCauses:
    """Search once more where the loops that were identified may hide a cause behind their own error.

    That is where nothing is named, although a misfit is allowed: first with loops that are refitted to the records,
    then beside a correction of them.
    """
    result = found.result
    names_cause = result.passes and result.chosen.hypothesis is not result.nominal.hypothesis
    tries = request.tests and request.problem.allowed and request.problem.subject.refit_parts is not None
    if names_cause or not tries or request.budget.spent:
        return found
    try:
        return _look_behind_refitted_loops(request, found) or _look_beside_correction(request, found) or found
    except CancelledError:
        return found


def _look_behind_refitted_loops(request: SearchRequest, found: FoundCauses) -> FoundCauses | None:
    """Search with refitted loops; return None where that finds nothing.

    What is found must be an effect of its own: loops that were refitted without it are no cause, and it has to lower
    the error on the test records by itself.
    """
    loops = request.problem.subject.find_identified_parts(request.model, request.dataset)
    refitter = request.loop_refitter(loops)
    refitted = refitter.refit_nominal(found.result) if loops else None
    if refitted is None:
        return None
    again = _search_behind_refitted_loops(request, refitted, refitter)
    is_alone = again.result.chosen.hypothesis.mechanisms == refitted.nominal.hypothesis.mechanisms
    if is_alone or again.cancelled or not again.result.passes:
        return None
    bare, least = refitted.chosen.hypothesis, request.problem.thresholds.search.least_holdout_gain
    gains = measure_gains(bare, again.result.chosen, request.problem, request.tests)
    return again if any(one.ratio > least and one.ratio_low > 1.0 for one in gains) else None


def _look_beside_correction(request: SearchRequest, found: FoundCauses) -> FoundCauses | None:
    """Search for one cause beside the catalogue's correction of the loops; return None where none is borne out."""
    claim = classify_outcome(
        found.result, request.problem.subject.least_share_removed, request.problem.thresholds.search
    )
    if claim not in ("adequate", "unexplained") or HYSTERESIS_SHAPE not in request.ids:
        return None
    problem = found.result.refined_problem or request.problem
    beside = BesideCorrection(
        HYSTERESIS_SHAPE, problem, request.tests, request.ids, budget=request.budget, report=request.report,
        level=significance_level(problem, request.options.false_claim_rate),
    )  # fmt: skip
    result = beside.search(found.result)
    return found._replace(result=result) if result else None


def _search_behind_refitted_loops(
    request: SearchRequest, refitted: SearchResult, refitter: LoopRefitter
) -> FoundCauses:
    """Search the catalogue with refitted loops in the nominal model, and refit them behind what is found."""
    bare = refitted.chosen.hypothesis
    problem = _allow_no_more_than_left(request.problem, bare, request.tests)
    found = _search(request._replace(problem=problem, nominal=bare), correct=False)
    if found.cancelled:
        return FoundCauses(refitted, found.notes, cancelled=True)
    problem = found.result.refined_problem or problem
    result, unsupported = drop_unsupported(found.result, problem, request.tests, request.ids, request.budget)
    notes = [*found.notes, *_note_unsupported(unsupported)]
    if result.chosen.hypothesis.mechanisms == refitted.chosen.hypothesis.mechanisms:
        return FoundCauses(refitted, [], cancelled=False)
    whole = result._replace(nominal=refitted.nominal, hysteresis_refit=refitted.hysteresis_refit)
    try:
        return FoundCauses(refitter.refit_behind(whole), notes, cancelled=False)
    except CancelledError:
        return FoundCauses(whole, [*notes, LOOPS_NOT_REFITTED], cancelled=True)


def _allow_no_more_than_left(problem: Problem, refitted: Hypothesis, tests: Sequence[FitRecord]) -> Problem:
    """Return the problem with no more allowed misfit than refitted loops leave on test records, by output."""
    allowed = dict(problem.allowed)
    for name in allowed:
        errors = [
            compute_free_run_error(refitted.simulation, one, name) for one in tests if name in one.measured
        ]
        if errors:
            allowed[name] = min(allowed[name], float(np.mean(np.concatenate(errors) ** 2)))
    return replace(problem, allowed=allowed)


def _find_coarse_loops(request: SearchRequest) -> LoopRefitter | None:
    subject = request.problem.subject
    if subject.refit_parts is None:
        return None
    request.report("whether the static loops are too coarse")
    request.problem.cancellation.raise_if_cancelled()
    coarse = subject.find_coarse_parts(request.model, request.dataset)
    return request.loop_refitter(coarse) if coarse else None


def _finish_by_test_records(request: SearchRequest, found: FoundCauses) -> FoundCauses:
    """Drop causes that test records do not support, then correct the static loops behind the others."""
    problem = found.result.refined_problem or request.problem
    result, unsupported = drop_unsupported(found.result, problem, request.tests, request.ids, request.budget)
    notes = [*found.notes, *_note_unsupported(unsupported)]
    try:
        return FoundCauses(correct_after_search(request, result), notes, cancelled=False)
    except CancelledError:
        return FoundCauses(result, [*notes, LOOPS_NOT_REFITTED], cancelled=True)


def _note_unsupported(names: Sequence[str]) -> list[str]:
    return [UNSUPPORTED.format(" and ".join(names))] if names else []


def correct_loops(request: SearchRequest, result: SearchResult) -> SearchResult | None:
    """Refit the static loops behind causes that explain a part; return None where that is not tried.

    Where a nonparametric alternative explains more, the causes are wrong, and refitted loops would hide that.
    """
    subject, limits = request.problem.subject, request.problem.thresholds.search
    partly = classify_outcome(result, subject.least_share_removed, limits) == "partly_explained"
    if not partly or subject.refit_parts is None or not request.tests or request.budget.spent:
        return None
    loops = subject.find_identified_parts(request.model, request.dataset)
    if not loops:
        return None
    nominal, chosen = result.nominal.hypothesis, result.chosen.hypothesis
    alternative = find_better_alternative(request.problem, nominal, chosen, request.budget, request.report)
    result = result._replace(better_alternative=alternative)
    return result if alternative else request.loop_refitter(loops).refit_behind(result)


def correct_after_search(request: SearchRequest, result: SearchResult) -> SearchResult:
    """Return the outcome with the static loops refitted if that helps, else as it is.

    Where no set passes and the loops were refitted during the search, that outcome is taken if it leaves less.
    """
    if result.passes:
        return _correct_passing_set(request, result)
    corrected = result.correction
    if corrected is None:
        return correct_loops(request, result) or result
    if corrected.chosen.hypothesis is result.chosen.hypothesis:
        return result._replace(better_alternative=corrected.better_alternative)
    unchanged = corrected.hysteresis_refit is None
    if unchanged or corrected.chosen.hypothesis.cost >= result.chosen.hypothesis.cost:
        return result
    return corrected._replace(out_of_time=result.out_of_time)


def _correct_passing_set(request: SearchRequest, result: SearchResult) -> SearchResult:
    """Refit the static loops behind a set that passes, where test records show that the loops are off.

    It passes because a model is allowed some misfit. Where other sets explain as much, all of them have the same loops
    and what the next experiment compares would be the loops.
    """
    problem, subject = request.problem, request.problem.subject
    named = result.chosen.hypothesis is not result.nominal.hypothesis and not result.equivalent
    if not (named and problem.allowed) or subject.refit_parts is None or request.budget.spent:
        return result
    if compute_error_over_noise(result.chosen, request.tests) < problem.thresholds.search.worth_correcting:
        return result
    loops = subject.find_identified_parts(request.model, request.dataset)
    if not loops:
        return result
    corrected = request.loop_refitter(loops).refit_behind(result)
    return corrected if corrected.passes else result


@dataclass(slots=True)
class _Progress:
    """What is known while a search runs, for the answer of one that is cancelled."""

    request: SearchRequest
    fits: int = 0
    known: SearchResult | None = None

    def report(self, text: str) -> None:
        self.request.report(text)
        self.request.problem.cancellation.raise_if_cancelled()
        self.fits += 1

    def keep(self, result: SearchResult) -> None:
        self.known = result


def _search(request: SearchRequest, *, correct: bool) -> FoundCauses:
    """Run the stepwise search; `correct`: refit the static loops behind two causes that do not pass.

    A search that is cancelled claims no cause, since larger or other sets might explain the data.
    """
    progress = _Progress(request)
    settings = SearchSettings(
        ids=request.ids, level=significance_level(request.problem, request.options.false_claim_rate),
        budget=request.budget, report=progress.report, keep=progress.keep,
        correct_model=partial(correct_loops, request) if correct else None,
    )  # fmt: skip
    try:
        result = search_stepwise(request.problem, request.nominal, settings)
    except CancelledError:
        assert progress.known is not None  # the nominal model is tested before the first report
        known = progress.known._replace(chosen=progress.known.nominal, equivalent=())
        return FoundCauses(known, [STOPPED.format(progress.fits)], cancelled=True)
    return FoundCauses(result, [_explain_end(request)] if result.out_of_time else [], cancelled=False)


def _explain_end(request: SearchRequest) -> str:
    """Return the note of a search that ended before it was through."""
    if request.budget.cut_by_clock:
        return CUT_BY_CLOCK.format(request.options.seconds)
    return OUT_OF_WORK.format(1e-6 * request.options.work)
