"""Records cut into short segments, each from its own initial state, where whole free runs are no judge.

A body without a spring adds up every small force for ever: over a whole record anything slow fits its drift, and what
acts within a stroke does not count. Within a segment there is no drift. The influence of the initial state, d output /
d initial state at the end of a record against its beginning, says whether a record is of that kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.weak_form import choose_half_width
from rtctl.identification.simulation_error.multiple_shooting import cut_segments
from rtctl.identification.simulation_error.segments import Segment


def drifts(problem: Problem, nominal: Hypothesis) -> bool:
    """Return whether the free runs of `nominal`, fitted, drift away and never forget their initial states."""
    limits = problem.thresholds.nominal_fit
    held = {record.stimulus.holds.get(problem.subject.drive) for record in problem.records}
    # a segment of a band-limited drive would have ends that the drive never had
    if not nominal.states or "band-limited" in held or not problem.subject.reads_initial_states:
        return False
    if relative_misfit(problem, nominal) < limits.close_misfit:
        return False
    try:
        lines = nominal.linearise(problem)
    except ArithmeticError:
        return False
    lasting, same_side = [], []
    for line in lines:
        displaced = line.local[0].sum(axis=0)
        same_side.append(np.mean(displaced * displaced[0] > 0.0))
        influence = np.abs(line.local[: nominal.states]).max(axis=(0, 1))
        tenth = max(1, len(influence) // 10)
        lasting.append(influence[-tenth:].max() / max(float(influence[:tenth].max()), 1e-300))
    remembered = limits.lasting_influence < np.median(lasting) < limits.diverging_influence
    return bool(remembered and np.median(same_side) > limits.same_side_share)


def cut_strokes(problem: Problem, nominal: Hypothesis) -> Problem:
    """Return the problem with its records cut into segments of a stroke; of very many, some evenly over all."""
    return replace(problem, records=tuple(segment.record for segment in _strokes(problem, nominal)))


def cut_test_strokes(
    problem: Problem, nominal: Hypothesis, tests: Sequence[FitRecord]
) -> tuple[FitRecord, ...]:
    """Return test records cut as those that are fitted, by which small causes and rivals are judged.

    Free runs over whole records drift apart for any small force, whichever causes a set has.
    """
    held = replace(problem, records=tuple(tests))
    return tuple(started(segment, nominal) for segment in _strokes(held, nominal)) if tests else ()


def _strokes(problem: Problem, nominal: Hypothesis) -> list[Segment]:
    limits = problem.thresholds.nominal_fit
    stroke_s = limits.stroke_periods * 2.0 * np.pi / problem.scales.rate
    pieces = cut_records(problem, nominal, max(stroke_s, limits.min_stroke_samples * problem.scales.period))
    count = min(limits.max_stroke_segments, len(pieces))
    return [pieces[k] for k in np.linspace(0, len(pieces) - 1, count).round().astype(int)]


def started(segment: Segment, nominal: Hypothesis) -> FitRecord:
    """Return the record of a segment with its estimated initial state."""
    initial = dict(zip(nominal.simulation.state, segment.start.tolist(), strict=True))
    return replace(segment.record, stimulus=replace(segment.record.stimulus, initial=initial))


def cut_records(problem: Problem, nominal: Hypothesis, length_s: float) -> list[Segment]:
    """Return all records in segments of about `length_s` [s], each with an estimated initial state."""
    width_s = choose_half_width(problem.records, problem.scales.rate)
    return [
        segment
        for record in problem.records
        for segment in cut_segments(record, nominal.simulation, length_s, width_s)
    ]
