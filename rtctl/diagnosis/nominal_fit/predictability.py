"""Predictability: the initial parts of records, up to where free runs take another course, or might.

Between two motions, those of a jump or of two wells, a model with any error goes the other way sooner or later. What
follows says nothing of the error; before that a free run is as good a judge as any. Where a parameter change below
0.1 % decides which way a run goes, a fit that happens to go the right way is held there by that one moment, and can
move no parameter any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.nominal_fit.misfit.segment_misfit import segment_rms
from rtctl.diagnosis.nominal_fit.multiple_shooting_start import fit_segments
from rtctl.diagnosis.nominal_fit.segmentation import cut_records, started
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.thresholds import NominalFitThresholds
from rtctl.identification.fit_record import FitRecord

IN_PIECES = (
    "free runs over whole test records are unpredictable: errors on test records are of {} pieces of {:g} periods of "
    "the motion, each from its own initial state"
)
UNDECIDED_PIECES = (
    "; {} further pieces are left out, in which the motion may go either of two ways and a parameter change below "
    "0.1 % decides which"
)
WHOLE = (
    "errors on test records are of free runs over whole records; causes were judged by shorter runs, so the two need "
    "not agree"
)


def fit_followed_parts(problem: Problem, nominal: Hypothesis) -> tuple[Problem, Hypothesis] | None:
    """Return the initial parts of records that the nominal model follows, with the model fitted to them.

    None where it follows all of every record, or next to none.
    """
    limits = problem.thresholds.nominal_fit
    if not nominal.states:
        return None
    close = relative_misfit(problem, nominal) < limits.close_misfit
    if close and _share_after(problem, nominal) < limits.max_share_after:
        return None
    fit = fit_as_far_as_followed(problem, nominal.simulation, nominal.mechanisms)
    if fit is None or fit[0].samples == problem.samples:
        return None
    parts, followed = fit
    kept = _before_diverging(problem, parts, followed)
    refitted = _fit_parts(parts, followed.simulation, followed.mechanisms, kept)
    return fit if refitted is None else refitted


def cut_unpredictable(problem: Problem, nominal: Hypothesis) -> Problem:
    """Return the problem with records cut to their predictable parts; itself where all, or next to none, is."""
    limits = problem.thresholds.nominal_fit
    kept = [
        reach if reach >= record.first + limits.min_followed_periods * period_of(problem, record) else 0
        for record, reach in zip(problem.records, _predictable_samples(problem, nominal), strict=True)
    ]
    parts = replace(problem, records=_initial_parts(problem.records, kept))
    enough = limits.min_followed_share * problem.samples <= parts.samples < problem.samples
    return parts if enough else problem


def cut_unpredictable_tests(
    problem: Problem, nominal: Hypothesis, tests: tuple[FitRecord, ...]
) -> tuple[tuple[FitRecord, ...], str]:
    """Return the test records in pieces in which free runs are predictable, each from its own initial state.

    Beyond, the error of a free run says which way it happened to go, of a right model as of a wrong one. They stay as
    they are where all of them is predictable, where the model diverges, and where the drive is band-limited: a piece of
    it would have ends that the drive never had.

    Returns:
        The records, and a note that says what errors on them are of.
    """
    held = replace(problem, records=tests)
    run = _run(held, nominal) if _can_be_cut(problem, nominal, tests) else None
    if run is None or not count_unpredictable(held, run):
        return tests, WHOLE
    return _cut_into_pieces(held, nominal) or (tests, WHOLE)


def cut_tests_of_another_course(
    problem: Problem, chosen: Hypothesis, tests: tuple[FitRecord, ...]
) -> tuple[tuple[FitRecord, ...], str]:
    """Return the test records in pieces where the free runs of a set that was found take another course than they do.

    A linear model predicts any record to its end; with a stop or a stiff spring in it the same record may be chaotic,
    and the right set no better over all of it than a wrong one. That is so where the set follows the fitted records,
    and short segments of the test records, but not these as a whole.

    Returns:
        The records, and a note that says what errors on them are of; "" where they stay whole.
    """
    held, limits = replace(problem, records=tests), problem.thresholds.nominal_fit
    run = _run(held, chosen) if _can_be_cut(problem, chosen, tests) else None
    if run is None:
        return tests, ""
    misfit = relative_misfit(held, run)
    strays = relative_misfit(problem, chosen) < limits.close_misfit <= misfit
    if not (strays and segment_rms(held, run) < limits.followed_within_segments * misfit):
        return tests, ""
    return _cut_into_pieces(held, chosen) or (tests, "")


def _can_be_cut(problem: Problem, hypothesis: Hypothesis, tests: Sequence[FitRecord]) -> bool:
    limited = {record.stimulus.holds.get(problem.subject.drive) for record in tests} & {"band-limited"}
    return bool(tests and hypothesis.states and not limited and problem.subject.reads_initial_states)


def _cut_into_pieces(held: Problem, hypothesis: Hypothesis) -> tuple[tuple[FitRecord, ...], str] | None:
    """Return the predictable pieces of all records and a note on them; None where that is too little of them."""
    limits = held.thresholds.nominal_fit
    periods = limits.predictable_periods
    pieces = [
        started(segment, hypothesis)
        for segment in cut_records(held, hypothesis, periods * 2.0 * np.pi / held.scales.rate)
    ]
    kept = _predictable_pieces(replace(held, records=tuple(pieces)), hypothesis)
    if len(kept) < limits.least_predictable_pieces * len(pieces):
        return None
    text, lost = IN_PIECES.format(len(kept), periods), len(pieces) - len(kept)
    return kept, text + (UNDECIDED_PIECES.format(lost) if lost else "")


def _predictable_pieces(problem: Problem, nominal: Hypothesis) -> tuple[FitRecord, ...]:
    """Return the records in which a small change of a parameter changes the motion little."""
    limits, run = problem.thresholds.nominal_fit, _run(problem, nominal)
    try:
        lines = run.linearise(problem) if run is not None else None
    except ArithmeticError:
        lines = None
    if lines is None:
        return ()
    sizes = np.array([problem.size(name) for name in nominal.sensitivity.outputs])[:, None]
    steepest = [float(np.max(np.abs(line.shared) / sizes, initial=0.0)) for line in lines]
    return tuple(
        record
        for record, slope in zip(problem.records, steepest, strict=True)
        if slope < limits.predictable_piece_slope
    )


def _run(problem: Problem, nominal: Hypothesis) -> Hypothesis | None:
    """Return the nominal model on other records, from their own initial states."""
    return fit_hypothesis(
        problem,
        nominal.simulation,
        nominal.mechanisms,
        iterations=0,
        fixed_parameters=nominal.fixed_parameters,
    )


def count_unpredictable(problem: Problem, hypothesis: Hypothesis) -> int:
    """Return the number of records whose end is unpredictable."""
    return sum(
        reach < record.samples
        for record, reach in zip(problem.records, _predictable_samples(problem, hypothesis), strict=True)
    )


def _predictable_samples(problem: Problem, hypothesis: Hypothesis) -> list[int]:
    """Return, of each record, the number of samples up to where the free run is unpredictable."""
    limits = problem.thresholds.nominal_fit
    everything = [record.samples for record in problem.records]
    if not hypothesis.states:
        return everything
    try:
        lines = hypothesis.linearise(problem)
    except ArithmeticError:
        return everything
    sizes = np.array([problem.size(name) for name in hypothesis.sensitivity.outputs])[:, None]
    reach = []
    for record, line in zip(problem.records, lines, strict=True):
        steepest = np.max(np.abs(line.shared) / sizes, axis=(0, 1), initial=0.0)
        lost = np.flatnonzero(~(steepest < limits.unpredictable_slope))
        sure = np.array([len(steepest) - 1])
        if len(lost):
            sure = np.flatnonzero(steepest[: lost[0]] < limits.predictable_slope)
        reach.append(record.first + int(sure[-1]) + 1 if len(sure) else 0)
    return reach


def fit_as_far_as_followed(
    problem: Problem, simulation: Simulation, mechanisms: Sequence[str]
) -> tuple[Problem, Hypothesis] | None:
    """Fit a model to the initial parts of records that it follows.

    Returns:
        The parts, which may be whole records, with the fit; None where it follows next to none.
    """
    limits = problem.thresholds.nominal_fit
    best: tuple[Problem, Hypothesis] | None = None
    starts = [simulation, *fit_segments(problem, simulation)]
    simulation = max(starts, key=lambda one: sum(_followed_samples(problem, one)))
    for _ in range(limits.max_prediction_rounds):
        kept = _followed_samples(problem, simulation)
        fit = _fit_parts(problem, simulation, mechanisms, kept)
        if fit is None or (best is not None and fit[0].samples <= best[0].samples):
            break
        best, simulation = fit, fit[1].simulation
    if best is None or best[0].samples < limits.min_followed_share * problem.samples:
        return None
    return best


def _before_diverging(problem: Problem, parts: Problem, followed: Hypothesis) -> list[int]:
    """Return, of each record of `parts`, its samples without last periods in which the free run already diverges.

    Only records that were cut lose periods, and only those whose residual is far above the record's median.
    """
    limits = problem.thresholds.nominal_fit
    whole = {record.name: record.samples for record in problem.records}
    try:
        lines = followed.linearise(parts)
    except ArithmeticError:
        return [record.samples for record in parts.records]
    kept = []
    for record, line in zip(parts.records, lines, strict=True):
        period, late = period_of(problem, record), 0
        count = (record.samples - record.first) // period
        if record.samples < whole[record.name]:
            error = line.residual[:, -count * period :].reshape(-1, count, period)
            rms = np.sqrt(np.mean(error**2, axis=2))
            usual = (rms <= limits.diverging_ratio * np.median(rms, axis=1, keepdims=True)).all(axis=0)
            late = int(np.argmax(usual[::-1]))
        kept.append(record.samples - (late * period if late <= limits.max_diverging_share * count else 0))
    return kept


def _share_after(problem: Problem, nominal: Hypothesis) -> float:
    """Return the fraction of the squared error at the fit that lies after the free runs take another course."""
    total = after = 0.0
    most = problem.thresholds.nominal_fit.diverged_rms
    try:
        lines = nominal.linearise(problem)
    except ArithmeticError:
        return 0.0
    for record, line in zip(problem.records, lines, strict=True):
        for name, error in zip(nominal.sensitivity.outputs, line.residual, strict=True):
            squares = (error / problem.size(name)) ** 2
            spread = float(np.std(record.measured[name]))
            reach = followed_samples(error, period_of(problem, record), most * spread)
            total += float(squares.sum())
            after += float(squares[reach:].sum())
    return after / total if total > 0.0 else 0.0


def period_of(problem: Problem, record: FitRecord) -> int:
    """Return the samples of `record` in a period of the dominant motion."""
    return max(1, round(2.0 * np.pi / (problem.scales.rate * record.period_s)))


def _initial_parts(records: Sequence[FitRecord], kept: Sequence[int]) -> tuple[FitRecord, ...]:
    """Return so many first samples of each record; those of 0 samples are left out."""
    return tuple(record.truncate(count) for record, count in zip(records, kept, strict=True) if count)


def _fit_parts(
    problem: Problem, simulation: Simulation, mechanisms: Sequence[str], kept: Sequence[int]
) -> tuple[Problem, Hypothesis] | None:
    """Fit a model to so many first samples of each record; None where nothing is kept, or it diverges."""
    records = _initial_parts(problem.records, kept)
    if not records:
        return None
    parts = replace(problem, records=records)
    fit = fit_hypothesis(parts, simulation, mechanisms)
    return None if fit is None else (parts, fit)


def _followed_samples(problem: Problem, simulation: Simulation) -> list[int]:
    """Return, of each record, the samples before a free run takes another course; 0 where that is too soon."""
    values = np.array([one.value for one in simulation.parameters])
    limits = problem.thresholds.nominal_fit
    return [
        _followed_of(record, simulation, values, period_of(problem, record), limits)
        for record in problem.records
    ]


def _followed_of(
    record: FitRecord, simulation: Simulation, values: FloatArray, period: int, limits: NominalFitThresholds
) -> int:
    """Return the samples of one record before a free run takes another course; 0 where that is too soon."""
    run = simulation.predict(record.stimulus, values)
    reach = record.samples
    for name in (one for one in simulation.outputs if one in record.measured):
        measured = record.measured[name]
        error = np.nan_to_num(run.outputs[name][0] - measured, nan=np.inf, posinf=np.inf, neginf=np.inf)
        most = limits.diverged_rms * float(np.std(measured))
        reach = min(reach, followed_samples(error, period, most))
    return reach if reach >= record.first + limits.min_followed_periods * period else 0


def followed_samples(error: FloatArray, period: int, most: float) -> int:
    """Return the samples of `error` (n,) before the first period of which the RMS is not below `most`."""
    count = len(error) // period
    if not count:
        return 0
    with np.errstate(over="ignore"):  # of a run that diverges
        rms = np.sqrt(np.mean(error[: count * period].reshape(count, period) ** 2, axis=1))
    parted = np.flatnonzero(~(rms < most))
    return int(parted[0]) * period if len(parted) else len(error)
