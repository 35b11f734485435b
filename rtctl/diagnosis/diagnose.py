"""From a dataset and today's model to the answer: refit, search, name, extend, measure, propose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rtctl.border.errors import RunError
from rtctl.border.simulation import Simulation
from rtctl.border.work import metered
from rtctl.diagnosis.experiment_design.isolability import isolability
from rtctl.diagnosis.experiment_design.next_experiment import next_experiment
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit, fit_nominal
from rtctl.diagnosis.nominal_fit.parameter_shift import far_off
from rtctl.diagnosis.problem.cancellation import CancelledError
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.sample_budget import check_speed, fewer
from rtctl.diagnosis.problem.work_budget import WallClockGuard, WorkBudget
from rtctl.diagnosis.report.answer import (
    apart_from_identification,
    causes_of,
    loops_cause,
    wrong_value_cause,
)
from rtctl.diagnosis.residual.bursts import bursts, leftovers
from rtctl.diagnosis.residual.localization import places
from rtctl.diagnosis.residual.missing_force import residual_shape
from rtctl.diagnosis.residual.noise_floor import left_over_noise, noise_cost_of
from rtctl.diagnosis.residual.parameter_estimates import estimates_by_mechanism
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.residual.tones import tones
from rtctl.diagnosis.result import Diagnosis, Fits
from rtctl.diagnosis.screening.checks import short, split
from rtctl.diagnosis.screening.unknown_initial_state import forgotten, has_two_wells, warmed_up
from rtctl.diagnosis.search.catalogue_search import DiagnosisOptions, SearchRequest, find_causes
from rtctl.diagnosis.search.holdout_error import Gain, measure_gain
from rtctl.diagnosis.search.hysteresis_refit import ID as SHAPE
from rtctl.diagnosis.search.nonparametric import find_better_alternative, find_memory_alternative
from rtctl.diagnosis.search.outcome import SearchResult, classify_outcome
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.diagnosis.verification.verdict import confirmed, doubtful
from rtctl.diagnosis.verification.verdict_checks import held
from rtctl.diagnosis.verification.wald_test import wrong_value
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.simulation_error.output_error import open_thread_pool
from rtctl.measured.dataset import Dataset
from rtctl.plants.subjects import subject_for, subject_of
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE

RIVALS = 5
"""Candidates that the next experiment has to tell apart, at most."""

LEAST_ALLOWED = 0.0025
"""Of an output's size: the read-outs are tables of cells."""

TOO_EARLY = (
    "stopped by the user while the nominal model was re-fitted: nothing is known yet, nothing was written"
)
OTHER_OUTPUT = (
    "no record that is fitted has a {0}: diagnosed by the {1} alone, and the gain is that of its logarithm"
)
NOT_HELD = (
    "{} would remove much of the error, but not on the test records too, or as laws of dissipation that together "
    "imitate another: not named"
)
LEFT_BY_IDENTIFICATION = (
    "{} would remove some of what is left, less than half, but not on the test records too: that is what the "
    "identification of the static loops left, and no cause; longer staircases, or more --cells, leave less"
)
OUTDONE = "{} would remove most of the error, but a law of no name leaves less: not named. {} See where the gap lives"
NOT_COMPARED = (
    "stopped by the user before the laws of no name were compared: one of them may explain it better than {}"
)
CORRECTED = (
    "{} is in the extended model and no cause: the model was identified while the causes acted, and its loops need "
    "that small correction once they are in it"
)
PUT_RIGHT = (
    "the static loops of the extended model were learned anew from the staircases and the fitted records, which lowers "
    "the error on the test records: no cause, what lies between the levels of the staircases had not been measured"
)
FOLLOWED = 2.0
"""Times the cost of a sample of the beginnings: whole records that leave less are followed to their ends."""
LEFT = "with these causes what is left is {:.3g} times the noise (RMS)"
NO_GAIN = (
    "with these causes the error of the {} on the test records is {:.3g} times as large: they help another reading or "
    "the fitted records only; do not use the extended model before that is understood"
)
SHARPEST = 'of {} questions to what is left, "{}" fails most clearly (p = {:.2g})'


@metered()
def diagnose(
    dataset: Dataset,
    model: Any,
    simulation: Simulation,
    ids: Sequence[str],
    options: DiagnosisOptions | None = None,
    report: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """Diagnose `simulation` (of `model`) by the records of `dataset`. Raises InputError, RunError.

    `report` hears what is under way.
    """
    options = options or DiagnosisOptions()
    budget = WorkBudget.of(options.work, guard=WallClockGuard(seconds=options.seconds))
    subject = subject_for(simulation.kind, dataset)
    fit, tests, warnings = split(dataset, subject)
    if subject.output != subject_of(subject.kind).output:
        warnings.append(OTHER_OUTPUT.format(subject_of(subject.kind).signal, subject.signal))
    fit, said = fewer(fit)
    warnings += said
    check_speed(simulation, fit, str(dataset.path))
    comparable, readings = subject.comparable(simulation, fit)
    fit, tests = (
        tuple(replace(one, measured=readings(one.measured)) for one in ones) for ones in (fit, tests)
    )
    scales = subject.scales(fit)
    fit, tests, said = (
        forgotten(fit, tests, comparable)
        if subject.is_at_rest_undriven
        else warmed_up(fit, tests, scales.rate, two_wells=has_two_wells(comparable))
    )
    warnings += said
    with open_thread_pool(options.threads) as executor:
        problem = Problem(
            subject=subject, records=fit, scales=scales,
            executor=executor if len(fit) > 1 else None,
            steps_per_period=subject.steps_per_period, cancellation=options.cancellation,
            thresholds=options.thresholds,
        )  # fmt: skip
        try:
            first = fit_nominal(problem, comparable, report)
        except CancelledError:
            raise RunError(TOO_EARLY) from None
        problem, nominal = first.problem, first.nominal
        warnings += [*short(fit, problem.scales.rate), *first.said]
        problem = allowing(problem, subject.promised(model, dataset))
        ask = SearchRequest(problem, nominal, model, dataset, tests, ids, options, budget, report)
        found, said, stopped = find_causes(ask, whole=first.uncut)
        warnings += [*said, *far_off(comparable, found.nominal, problem.scales)]
        ask = ask._replace(problem=found.refined_problem or problem)
        fits = _over_whole_records(first, ask.problem, found)
        answer = _answer(ask, simulation, found, fits, warnings, uncut=first.uncut, stopped=stopped)
        if answer.verdict != "adequate" or fits is not None:
            return answer
        return _unless_a_value_is_off(answer, model, comparable, options.false_claim_rate)


def allowing(problem: Problem, promised: Mapping[str, float]) -> Problem:
    """With the misfit that is no gap, where the subject has such: what is `promised` of an output [RMS], bounded."""
    share = problem.subject.allowed_share
    if not share:
        return problem
    allowed = {}
    for name in problem.records[0].measured:
        size = problem.size(name)
        allowed[name] = float(np.clip(promised.get(name, np.inf), LEAST_ALLOWED * size, share * size)) ** 2
    return replace(problem, allowed=allowed)


def _answer(
    ask: SearchRequest, before: Simulation, found: SearchResult, whole: Fits | None, warnings: list[str], *,
    uncut: bool, stopped: bool,
) -> Diagnosis:  # fmt: skip
    """From the search to what is told. `uncut`: it was in whole records, and they show all that acts in them."""
    dataset, model, problem, tests = ask.dataset, ask.model, ask.problem, ask.tests
    units, output = {LOG_RESISTANCE: "ln(ohm)"} | dict(dataset.units), problem.subject.output
    noise_cost, noise_rms = noise_cost_of(found.chosen), _noise_rms(found.chosen, output)
    fits = whole or Fits(found.nominal, found.chosen)

    def gained(fits: Fits, output: str) -> Gain | None:
        return _gained(fits, output, units, tests, _noise_rms(found.chosen, output), problem)

    seen = [
        name
        for name in found.nominal.hypothesis.sensitivity.outputs
        if all(name in t.measured for t in tests)
    ]
    verdict, said, interrupted = _verdict(
        found, problem, [gained(fits, name) for name in seen], ask.budget, ask.report
    )
    warnings += said
    stopped = stopped or interrupted
    named = verdict in ("explained", "partly_explained")
    fits = fits if named else Fits(fits.before, fits.before)
    final = gained(fits, output)
    verdict, said = held(verdict, final, fits.after, problem, tests, uncut=uncut)
    warnings += said
    causes = causes_of(found, noise_cost, fits.after) if named else []
    learned = loops_cause(found, noise_cost) if named else None
    causes += [learned] if learned else []
    warnings += [PUT_RIGHT] if named and found.hysteresis_refit and learned is None else []
    alike = [one.simulation for one in (fits.after.hypothesis, *found.equivalent)]
    causes, corrected = apart_from_identification(causes, alike)
    if corrected:
        warnings.append(CORRECTED.format(" and ".join(corrected)))
    where = places(found.nominal) if verdict != "adequate" else []
    gap = verdict in ("unexplained", "partly_explained")
    if verdict == "partly_explained":
        warnings.append(LEFT.format(left_over_noise(found.chosen)))
    if named and final is not None and final.ratio < 1.0:
        warnings.append(NO_GAIN.format(final.output, 1.0 / final.ratio))
    if (
        gap
        and not (stopped or found.out_of_time)
        and not found.chosen.p_value > significance_level(ask.problem, ask.options.false_claim_rate)
    ):
        sharpest = min(found.chosen.tests, key=lambda one: one.p_value)
        warnings.append(SHARPEST.format(len(found.chosen.tests), sharpest.name, sharpest.p_value))
    if not gap:
        left = leftovers(found.chosen if named else found.nominal, problem)
        warnings += [*bursts(left, problem), *tones(left, problem, units)]
    return Diagnosis(
        verdict=verdict, causes=tuple(causes), where=tuple(where), search=found, problem=problem,
        tests=tests, before=before,
        gain=final, fits=fits, model=problem.subject.extended_model(
            model, fits.after.hypothesis.simulation, estimates_by_mechanism(fits.after)
        ), units=units,
        isolability=isolability(found.nominal),
        noise_rms=noise_rms,
        next_experiment=None if stopped else next_experiment(
            _rivals(found, verdict), found.nominal.hypothesis, problem, found.chosen.noise, units,
            nearest=verdict == "unexplained",
        ),
        shape=residual_shape(found.nominal, problem, [place.coordinate for place in where], units) if gap else None,
        warnings=tuple(warnings), stopped=stopped, cut_by_clock=found.out_of_time and ask.budget.cut_by_clock,
    )  # fmt: skip


def _verdict(
    found: SearchResult,
    problem: Problem,
    gains: Sequence[Gain | None],
    budget: WorkBudget,
    report: Callable[[str], None],
) -> tuple[str, list[str], bool]:
    """What may be claimed, what is to be said of it, and whether the user stopped the last comparison."""
    if found.hysteresis_refit is not None:  # only what holds on test records is learned anew
        return _unless_outdone(
            "explained" if found.passes else "partly_explained", found, problem, budget, report
        )
    judged = classify_outcome(found, problem.subject.least_removed, problem.thresholds.search)
    added = found.chosen.hypothesis.mechanisms[len(found.nominal.hypothesis.mechanisms) :]
    names = ", ".join(added)
    doubted = bool(added) and doubtful(found, bool(problem.allowed))
    laws = {one.id: one for one in found.chosen.hypothesis.simulation.mechanisms}
    correction = all(laws[name].of_identification for name in added)
    verdict = confirmed(judged, added, gains, doubted=doubted, correction=correction, allowed=problem.allowed)
    if verdict != judged:
        said = [(LEFT_BY_IDENTIFICATION if verdict == "adequate" and correction else NOT_HELD).format(names)]
        return verdict, said, False
    return _unless_outdone(verdict, found, problem, budget, report)


def _unless_outdone(
    verdict: str, found: SearchResult, problem: Problem, budget: WorkBudget, report: Callable[[str], None]
) -> tuple[str, list[str], bool]:
    """`verdict`, but unexplained where a law of no name leaves less than the causes, or is likelier than causes that
    leave nothing that the gate asks for.
    """
    if verdict not in ("explained", "partly_explained") or (
        verdict == "explained" and found.hysteresis_refit
    ):
        return verdict, [], False
    added = found.chosen.hypothesis.mechanisms[len(found.nominal.hypothesis.mechanisms) :]
    names = ", ".join(
        [*added, *([SHAPE] if found.hysteresis_refit and found.hysteresis_refit.is_cause else [])]
    )
    law = found.better_alternative
    if law is None:
        try:
            law = _law(verdict, found, problem, budget, report)
        except CancelledError:
            return verdict, [NOT_COMPARED.format(names)], True
    return ("unexplained", [OUTDONE.format(names, law)], False) if law else (verdict, [], False)


def _law(
    verdict: str, found: SearchResult, problem: Problem, budget: WorkBudget, report: Callable[[str], None]
) -> str:
    """Of no name, in a sentence, that takes the causes' place; "": none."""
    nominal, chosen = found.nominal.hypothesis, found.chosen
    if verdict == "explained":
        return find_memory_alternative(problem, nominal, chosen, budget, report)
    return find_better_alternative(problem, nominal, chosen.hypothesis, budget, report)


def _gained(
    fits: Fits,
    output: str,
    units: Mapping[str, str],
    tests: tuple[FitRecord, ...],
    noise_rms: float,
    problem: Problem,
) -> Gain | None:
    before, after = fits.before.hypothesis.simulation, fits.after.hypothesis.simulation
    return measure_gain(before, after, tests, output, units.get(output, ""), noise_rms, problem.scales.rate)


def _unless_a_value_is_off(answer: Diagnosis, model: Any, given: Simulation, rate: float) -> Diagnosis:
    """`answer`, adequate once it was re-fitted; explained where one value of the file alone is what was wrong."""
    problem = answer.problem
    wrong = wrong_value(problem, given, problem.subject.spreads(model), answer.search.nominal, rate)
    if wrong is None:
        return answer
    fits = Fits(wrong.given, wrong.revised)
    return replace(
        answer, verdict="explained", causes=(wrong_value_cause(wrong),), fits=fits,
        gain=_gained(fits, problem.subject.output, answer.units, answer.tests, answer.noise_rms, problem),
        model=problem.subject.extended_model(
            model, wrong.revised.hypothesis.simulation, estimates_by_mechanism(wrong.revised)
        ),
    )  # fmt: skip


def _over_whole_records(first: NominalFit, problem: Problem, found: SearchResult) -> Fits | None:
    """What was chosen within `data`, parts of records, fitted to free runs; None: it does not fit them, or less well.

    Nor where it was the beginnings and what follows is not followed as well: that would pull at the parameters.
    """
    if first.whole is None or first.uncut:
        return None
    whole, nominal = first.whole
    chosen = found.chosen.hypothesis
    again = fit_hypothesis(whole, chosen.simulation, chosen.mechanisms, still=chosen.still)
    if again is None or again.cost > nominal.cost:
        return None
    if first.parted and again.cost / whole.samples > FOLLOWED * chosen.cost / problem.samples:
        return None
    after = run_residual_tests(again, whole, ())
    return Fits(
        after if chosen is found.nominal.hypothesis else run_residual_tests(nominal, whole, ()), after
    )


def _rivals(found: SearchResult, verdict: str) -> list[Hypothesis]:
    """What an experiment has to tell apart: the equivalents, or the best of the causes that do not explain it."""
    if verdict == "explained":
        return [found.chosen.hypothesis, *found.equivalent][:RIVALS] if found.equivalent else []
    if verdict == "adequate" or not found.rankings:
        return []
    return [
        one.hypothesis for one in found.rankings[0][:2]
    ]  # a third is often no more than the nominal model again


def _noise_rms(examined: TestedHypothesis, output: str) -> float:
    """RMS of the noise of an output by its model, in units."""
    outputs = examined.hypothesis.sensitivity.outputs
    square = examined.noise[outputs.index(output)].mean_square if output in outputs else np.nan
    return float(np.sqrt(square))
