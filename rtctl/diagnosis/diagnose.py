"""From a dataset and today's model to the answer: screen, fit, search, verify, extend, localize, propose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from rtctl.border.errors import RunError
from rtctl.border.motion import with_displacement
from rtctl.border.simulation import Simulation
from rtctl.border.work import metered
from rtctl.diagnosis.experiment_design.isolability import compute_isolability
from rtctl.diagnosis.experiment_design.next_experiment import propose_experiment
from rtctl.diagnosis.experiment_design.unseen_effects import describe_unseen
from rtctl.diagnosis.nominal_fit.expected_time import tell_time
from rtctl.diagnosis.nominal_fit.misfit.allowed_misfit import allow_misfit
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit, fit_nominal
from rtctl.diagnosis.nominal_fit.parameter_shift import (
    note_common_starts,
    note_large_shifts,
    was_identified_from,
)
from rtctl.diagnosis.nominal_fit.predictability import cut_unpredictable_tests
from rtctl.diagnosis.nominal_fit.quiet_drive import take_off_drive_noise
from rtctl.diagnosis.nominal_fit.segmentation import cut_test_strokes
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subjects_of_model
from rtctl.diagnosis.problem.work_budget import WallClockGuard, WorkBudget
from rtctl.diagnosis.report.causes import name_causes
from rtctl.diagnosis.report.changed_signal import explain_by_changed_signals
from rtctl.diagnosis.report.file_value import explain_by_file_value
from rtctl.diagnosis.report.nearest_cause import describe_nearest_cause
from rtctl.diagnosis.report.remarks import describe_taken_noise, doubt_delays, doubt_kind, remark
from rtctl.diagnosis.report.rounding import explain_by_steps
from rtctl.diagnosis.report.same_laws import find_same_laws, tell_readings_at_the_end
from rtctl.diagnosis.residual.localization import localize_residual
from rtctl.diagnosis.residual.missing_force import estimate_missing_force
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.screening.excitation_checks import note_few_periods
from rtctl.diagnosis.screening.screen import screen_dataset
from rtctl.diagnosis.screening.steps import list_fitted, without_steps
from rtctl.diagnosis.search.catalogue_search import find_causes
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.record_parts.discarded_evidence import restore_evidence
from rtctl.diagnosis.search.record_parts.longer_parts import Searched, search_longer_parts
from rtctl.diagnosis.search.request import DiagnosisOptions, SearchRequest
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.diagnosis.verification.loop_model import model_for_loop
from rtctl.diagnosis.verification.refuted_causes import search_without_refuted
from rtctl.diagnosis.verification.rivals import choose_rivals
from rtctl.diagnosis.verification.verify import Verified, verify
from rtctl.diagnosis.verification.whole_record_fits import (
    Fits,
    HoldoutData,
    fit_whole_records,
    noise_rms_of,
)
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.threads import open_thread_pool
from rtctl.measured.dataset import Dataset


class _Question(NamedTuple):
    """What is asked of the records, whatever part of them is searched."""

    dataset: Dataset
    model: Any
    whole: Problem
    """Screened records."""
    tests: tuple[FitRecord, ...]
    ids: Sequence[str]
    options: DiagnosisOptions
    report: Callable[[str], None]
    promised: Mapping[str, float]
    """RMS misfit by output that the model's identification promises."""

    def fit(self, simulation: Simulation) -> NominalFit:
        """Fit a nominal model, and choose the parts that it can be judged by. Raises RunError."""
        first = fit_nominal(self.whole, simulation, self.report)
        return restore_evidence(first, self.ids, self.options.false_claim_rate)

    def without_drive_noise(
        self, first: NominalFit, simulation: Simulation
    ) -> tuple[_Question, NominalFit, tuple[str, ...]]:
        """Return what is asked of records with quiet drives, their fit and a note; all as it is where none is noisy."""
        quiet = take_off_drive_noise(self.whole, self.tests, first.nominal) if first.uncut else None
        if quiet is None:
            return self, first, ()
        asked = self._replace(whole=quiet.problem, tests=quiet.tests)
        again = asked.fit(simulation)
        if not quiet.bears_out(first.nominal, again.nominal):
            return self, first, ()
        drive = quiet.problem.subject.drive
        return asked, again, (describe_taken_noise(quiet.noise, drive, self.dataset.units[drive]),)

    def allow(self, first: NominalFit) -> Problem:
        """Return the parts with the misfit that is allowed."""
        return allow_misfit(first.problem, self.promised)

    def search(self, first: NominalFit, budget: WorkBudget) -> Searched:
        """Search the catalogue in the parts."""
        tests, judged, cut = _cut_tests(self.whole, first, self.tests)
        request = SearchRequest(
            self.allow(first), first.nominal, self.model, self.dataset, judged, self.ids, self.options, budget,
            self.report,
        )  # fmt: skip
        found = find_causes(request, whole=first.uncut)
        if first.uncut:
            return Searched(first, request, search_without_refuted(request, found), cut)
        return Searched(first, request, found._replace(tests=tests), cut)

    def search_all(self, first: NominalFit, budget: WorkBudget) -> Searched:
        """Tell how long it takes, then search the parts, and longer ones where what was found follows these."""
        told = tell_time(self.allow(first), first.nominal, budget, self.report)
        return search_longer_parts(
            self.search(first, told),
            self.fit_further,
            lambda parts: self.search(parts, told.for_longer_parts()),
        )

    def fit_further(self, extended: Simulation) -> NominalFit | None:
        """Fit a model with causes that were found, as far as it follows; None where it cannot be fitted."""
        self.report("the records as far as the model follows with what was found")
        try:
            return self.fit(extended)
        except RunError:
            return None


@metered()
def diagnose(
    dataset: Dataset,
    model: Any,
    simulation: Simulation,
    ids: Sequence[str],
    options: DiagnosisOptions | None = None,
    report: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """Diagnose a model by measured records.

    Args:
        dataset: Measured records.
        model: The model, of the type of its kind's model file.
        simulation: Simulation of that model.
        ids: Mechanisms of the catalogue that are tried.
        options: What a user may choose.
        report: Called with what is under way.

    Raises:
        InputError: The dataset cannot be diagnosed.
        RunError: The model cannot be fitted, or the user stopped before anything was known.
    """
    options = options or DiagnosisOptions()
    given, simulation = simulation, without_steps(simulation)
    budget = WorkBudget.of(options.work, guard=WallClockGuard(seconds=options.seconds))
    subject, usual = subjects_of_model(simulation, dataset)
    data = screen_dataset(dataset, simulation, subject, usual.required_signal, options.thresholds)
    fit, tests, notes = data.records
    with open_thread_pool(options.threads) as executor:
        problem = Problem(
            subject=subject, records=fit, scales=data.scales, executor=executor,
            steps_per_period=subject.steps_per_period, thresholds=options.thresholds,
            cancellation=options.cancellation,
        ).with_steps_of_all()  # fmt: skip
        fitted = list_fitted(simulation, ids)
        asked = _Question(
            dataset, model, problem, tests, fitted, options, report, subject.stated_misfit(model, dataset)
        )
        first = asked.fit(data.simulation)
        asked, first, heard = asked.without_drive_noise(first, data.simulation)
        problem, tests, notes = asked.whole, asked.tests, (*notes, *heard)
        first, request, found, cut = asked.search_all(first, budget)
        notes = (*notes, *cut, *subject.describe_screened(data.simulation))
        search, whole_tests, tests = found.result, tests, found.tests
        request = request._replace(problem=search.refined_problem or request.problem, tests=tests)
        whole = fit_whole_records(first, request.problem, search)
        units = dict(subject.output_units) | with_displacement(dataset.units)
        holdout = HoldoutData(tests, units, search.chosen, problem.scales.rate)
        fits = whole or Fits(search.nominal, search.chosen)
        verified = verify(search, request, fits, holdout, uncut=first.uncut)
        answer = _answer(request, simulation, search, verified, holdout, stopped=found.cancelled)
        if not subject.is_steady:
            notes += tuple(note_few_periods(fit, problem.scales.rate, options.thresholds.screening))
        answer = explain_by_changed_signals(answer, request, data.simulation, holdout)
        notes += (*first.notes, *filter(None, [found.course]), *found.notes)
        if not was_identified_from(model, dataset):
            notes += _note_shifts(data.simulation, answer, request.problem, model)
        answer = replace(answer, warnings=(*notes, *answer.warnings))
        is_final = answer.verdict != "adequate" or whole is not None
        if not is_final:
            answer = explain_by_file_value(answer, request, data.simulation, holdout)
        return explain_by_steps(answer, request._replace(ids=ids, tests=whole_tests), given)


def _note_shifts(given: Simulation, answer: Diagnosis, problem: Problem, model: Any) -> tuple[str, ...]:
    """Return what is said of values of the file that the fit of the answer changed by far."""
    told, stated = [cause.id for cause in answer.causes], problem.subject.relative_errors(model)
    return tuple(note_large_shifts(given, answer.kept, problem, told, stated))


def _cut_tests(
    problem: Problem, first: NominalFit, tests: tuple[FitRecord, ...]
) -> tuple[tuple[FitRecord, ...], tuple[FitRecord, ...], tuple[str, ...]]:
    """Return the test records that are scored, those that a search is judged by, and what is said of them."""
    if first.in_strokes:
        return tests, cut_test_strokes(problem, first.nominal, tests), ()
    if not tests or first.problem.samples == problem.samples:
        return tests, tests, ()
    pieces, note = cut_unpredictable_tests(problem, first.nominal, tests)
    return pieces, pieces, (note,)


def _answer(
    request: SearchRequest, before: Simulation, search: SearchResult, verified: Verified,
    holdout: HoldoutData, *, stopped: bool,
) -> Diagnosis:  # fmt: skip
    """Name the causes, extend the model, localize what is left, and propose the next experiment."""
    problem, verdict, fits, units = request.problem, verified.verdict, verified.fits, holdout.units
    stopped = stopped or verdict.stopped
    same_laws = find_same_laws(
        problem.subject.from_comparable(search.nominal.hypothesis.simulation),
        request.ids,
        search.chosen.hypothesis.simulation,
        ("displacement",) if problem.subject.is_steady else problem.measured,
    )
    named = name_causes(search, verified, problem, same_laws)
    causes = tell_readings_at_the_end(
        named.causes, search.chosen.hypothesis.simulation.mechanisms, problem.scales.period, request.ids
    )
    least_share = problem.thresholds.residual.least_located_share
    where = localize_residual(search.nominal, least_share) if verdict.claim != "adequate" else []
    coordinates = [place.coordinate for place in where]
    level = significance_level(problem, request.options.false_claim_rate)
    isolability = compute_isolability(search.nominal, level)
    remarks = remark(verified, search, problem, units, request.options.false_claim_rate, stopped=stopped)
    if verdict.claim == "unexplained":
        remarks += describe_nearest_cause(
            search, holdout, problem.subject.output, problem.thresholds.report, stopped=stopped
        )
    if verdict.claim == "adequate":
        remarks += note_common_starts(search.nominal, problem)
        remarks += describe_unseen(isolability, problem.thresholds.report)
    request.report("the next experiment, and what the answer is worth")
    proposed = None if stopped or not problem.subject.takes_scenarios else propose_experiment(
        choose_rivals(search, verdict, problem.thresholds.verification),
        search.nominal.hypothesis, problem, search.chosen.noise, units, nearest=verdict.claim == "unexplained",
    )  # fmt: skip
    extended = model_for_loop(request, fits.after, rehearsed=bool(causes))
    doubt = problem.subject.doubt(request.model)
    gain = (
        verified.gain
        if extended.fit is fits.after
        else extended.gain_of(fits, holdout, problem.subject.output)
    )
    return Diagnosis(
        verdict=verdict.claim, causes=causes, loop=extended.rehearsal, doubt=doubt,
        kind_doubt=doubt_kind(search, problem) if verdict.leaves_gap else "",
        gain=gain, helps=verified.helps, where=tuple(where),
        search=search, problem=problem, tests=request.tests, fits=fits, before=before,
        model=extended.model, units=units, isolability=isolability, next_experiment=proposed,
        noise_rms=noise_rms_of(search.chosen, problem.subject.output),
        level=level,
        shape=estimate_missing_force(search.nominal, problem, coordinates, units)
        if verdict.leaves_gap and not problem.subject.is_steady else None,
        warnings=(*filter(None, [doubt]), *verdict.notes, *named.notes, *doubt_delays(causes, problem), *remarks),
        stopped=stopped, cut_by_clock=search.out_of_time and request.budget.cut_by_clock,
    )  # fmt: skip
