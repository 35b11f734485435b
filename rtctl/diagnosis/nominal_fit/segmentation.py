"""Records cut into short stretches, each from a state of its own, where whole free runs are no judge.

A body without a spring adds up every small force for ever: over a whole record anything slow fits its drift, and what
acts within a stroke does not count. Within a stretch there is no drift. The influence of the initial state says
whether a record is of that kind: d output / d initial state, at the end of a record against its beginning.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.multiple_shooting_start import FAR, misfit
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.oscillator.weak_form import choose_half_width
from rtctl.identification.simulation_error.multiple_shooting import cut_segments

STROKE = 0.5
"""Periods: length of a stretch of what drifts."""
LEAST_SAMPLES = 200
MOST = 160
"""Stretches: each has a start and a phase of the mains of its own, and memory goes with all of them squared."""
STILL_KNOWN = 0.3
"""Of the influence that an initial state had at first, at the end of a record."""
ONWARD = 0.8
"""Of a record, in which a body that was displaced at its start is still displaced that way: with a spring it swings,
and is on one side half of the time however long it rings."""
PARTED = 30.0
"""Times the influence that it had at first: a double integrator's grows ten times over a record; two runs that part
exponentially, as between two wells, are no drift."""


def remembers(problem: Problem, nominal: Hypothesis) -> bool:
    """Whether the free runs of `nominal`, fitted, drift away and never forget their starts."""
    held = {record.stimulus.holds.get(problem.subject.drive) for record in problem.records}
    if not nominal.states or "band-limited" in held or misfit(problem, nominal) < FAR:
        return False  # a piece of a band-limited drive has ends that it never had
    try:
        lines = nominal.linearise(problem)
    except ArithmeticError:
        return False
    lasting, onward = [], []
    for line in lines:
        displaced = line.local[0].sum(axis=0)
        onward.append(np.mean(displaced * displaced[0] > 0.0))
        influence = np.abs(line.local[: nominal.states]).max(axis=(0, 1))
        tenth = max(1, len(influence) // 10)
        lasting.append(influence[-tenth:].max() / max(float(influence[:tenth].max()), 1e-300))
    return bool(STILL_KNOWN < np.median(lasting) < PARTED and np.median(onward) > ONWARD)


def cut_up(problem: Problem, nominal: Hypothesis) -> Problem:
    """The same records as stretches of a stroke; of very many, some evenly over all."""
    length_s = max(STROKE * 2.0 * np.pi / problem.scales.rate, LEAST_SAMPLES * problem.scales.period)
    width_s = choose_half_width(problem.records, problem.scales.rate)
    pieces = [
        segment.record
        for record in problem.records
        for segment in cut_segments(record, nominal.simulation, length_s, width_s)
    ]
    kept = np.linspace(0, len(pieces) - 1, min(MOST, len(pieces))).round().astype(int)
    return replace(problem, records=tuple(pieces[k] for k in kept))
