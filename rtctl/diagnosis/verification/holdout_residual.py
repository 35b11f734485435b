"""What the test records hold that no fitted record shows: then nothing was explained, whatever the gate says.

An error there may also be what the fitted records leave open of the parameters, at another amplitude: not if they
still miss once the test records take part in a fit, which gives no value to anything that is told. Nor does a free run
count that goes another way from some moment on: within short stretches, each from a state of its own, it would be
right.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.diagnosis.nominal_fit.multiple_shooting_start import left_over_stretches
from rtctl.diagnosis.nominal_fit.predictability import unforeseeable
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.identification.fit_record import FitRecord

MISSED = 2.0
"""Times the noise (and what is allowed beside it)."""
NO_WORSE = 1.05
"""Times the error on the fitted records: beyond it the test records ask for another device."""
ITERATIONS = 8
BEYOND = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise, and the fitted records show nothing of it: either "
    "they were measured or written otherwise (units, signs, initial), or something is missing that acts there only; "
    'mark one of the test records use = "fit" to have it looked for'
)
UNCERTAIN = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise: the fitted records leave so much open of the "
    'parameters there; mark one of the test records use = "fit" to tell them better'
)
UNFORESEEN = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise: in {} of {} records, from some moment on, less "
    "than a thousandth of a parameter decides what the model does, and none follows such a record to its end"
)
PARTED = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise: from some moment on their free runs go another "
    "way; within a few periods the model follows"
)


class Unseen(NamedTuple):
    """What is to be said of the test records, and whether it is a gap."""

    said: str
    is_gap: bool


def unseen(
    found: Gain, problem: Problem, tests: tuple[FitRecord, ...], hypothesis: Hypothesis
) -> Unseen | None:
    """Of `hypothesis`, fitted to all of `data`, whose error on `tests` is `found`; None where they are as they should.

    Records of `data` have to be whole.
    """
    promised = float(np.hypot(found.noise_floor, np.sqrt(problem.allowed.get(found.output, 0.0))))
    if not found.after > MISSED * promised:
        return None
    left = found.after, found.unit, found.after / found.noise_floor
    there = replace(problem, records=tests)
    alone = _at(there, hypothesis)
    if alone is not None and (lost := unforeseeable(there, alone)):
        return Unseen(UNFORESEEN.format(*left, lost, len(tests)), False)
    both = _with_them(problem, tests, hypothesis)
    if both is not None:
        here, beside = _parts(both, len(problem.records))
        settled = _error(here, problem, found.output) < NO_WORSE * _error(hypothesis, problem, found.output)
        if settled and _error(beside, there, found.output) < MISSED * promised:
            return Unseen(UNCERTAIN.format(*left), False)
    if alone is not None and alone.states:
        within = left_over_stretches(there, alone) * problem.size(found.output)
        if within < MISSED * promised:
            return Unseen(PARTED.format(*left), False)
    return Unseen(BEYOND.format(*left), True)


def _at(problem: Problem, hypothesis: Hypothesis) -> Hypothesis | None:
    """The same on other records; None: it diverges there."""
    return fit_hypothesis(
        problem, hypothesis.simulation, hypothesis.mechanisms, iterations=0, still=hypothesis.still
    )


def _with_them(problem: Problem, tests: tuple[FitRecord, ...], hypothesis: Hypothesis) -> Hypothesis | None:
    """Fitted to all records; None where that diverges."""
    alone = _at(replace(problem, records=tests), hypothesis)
    if alone is None:
        return None
    both = replace(problem, records=(*problem.records, *tests))
    starts = np.concatenate((hypothesis.starts, alone.starts))
    return fit_hypothesis(both, alone.simulation, alone.mechanisms, starts, ITERATIONS, still=alone.still)


def _parts(both: Hypothesis, count: int) -> tuple[Hypothesis, Hypothesis]:
    """Of the first `count` records and of the others."""
    return replace(both, starts=both.starts[:count]), replace(both, starts=both.starts[count:])


def _error(hypothesis: Hypothesis, problem: Problem, output: str) -> float:
    """RMS of `output` over the records of `data`; infinite where it diverges."""
    total, count = 0.0, 0
    for index, record in enumerate(problem.records):
        start = np.atleast_2d(hypothesis.start(index))
        run = hypothesis.simulation.predict(record.stimulus, hypothesis.values_of(index), start)
        error = (run.outputs[output][0] - record.measured[output])[record.first :]
        total, count = total + float(error @ error), count + len(error)
    return float(np.sqrt(total / count)) if np.isfinite(total) else np.inf
