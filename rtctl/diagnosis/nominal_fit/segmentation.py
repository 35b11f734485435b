"""Records cut into short segments, each from its own initial state, where whole free runs are no judge.

A body without a spring adds up every small force for ever: over a whole record anything slow fits its drift, and what
acts within a stroke does not count. Within a segment there is no drift. The influence of the initial state, d output /
d initial state at the end of a record against its beginning, says whether a record is of that kind.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.regression.weak_form import choose_half_width
from rtctl.identification.simulation_error.multiple_shooting import cut_segments


def drifts(problem: Problem, nominal: Hypothesis) -> bool:
    """Return whether the free runs of `nominal`, fitted, drift away and never forget their initial states."""
    limits = problem.thresholds.nominal_fit
    held = {record.stimulus.holds.get(problem.subject.drive) for record in problem.records}
    # a segment of a band-limited drive would have ends that the drive never had
    if not nominal.states or "band-limited" in held:
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
    limits, scales = problem.thresholds.nominal_fit, problem.scales
    stroke_s = limits.stroke_periods * 2.0 * np.pi / scales.rate
    length_s = max(stroke_s, limits.min_stroke_samples * scales.period)
    width_s = choose_half_width(problem.records, scales.rate)
    pieces = [
        segment.record
        for record in problem.records
        for segment in cut_segments(record, nominal.simulation, length_s, width_s)
    ]
    count = min(limits.max_stroke_segments, len(pieces))
    kept = np.linspace(0, len(pieces) - 1, count).round().astype(int)
    return replace(problem, records=tuple(pieces[k] for k in kept))
