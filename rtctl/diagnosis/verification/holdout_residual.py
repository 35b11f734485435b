"""A residual on the test records that no fit record shows: it contradicts a verdict, unless something else explains it.

The error may be what the fit records leave open of the parameters, at another amplitude: then a fit to all records,
which gives no reported value, removes it. A free run may also diverge from the record at some moment: within short
segments, each from its own initial state, the model follows all the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.nominal_fit.misfit.segment_misfit import segment_rms
from rtctl.diagnosis.nominal_fit.predictability import count_unpredictable
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel, fit_noise

MISSED = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise, and the fitted records show nothing of it: either "
    "the test records were measured or written otherwise (units, signs, initial), or something is missing that acts "
    'there only; mark one of the test records use = "fit" to have it looked for'
)
UNCERTAIN = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise: the fitted records determine the parameters "
    'no better there; mark one of the test records use = "fit"'
)
UNPREDICTABLE = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise: in {} of {} records the free run is unpredictable "
    "beyond some time, where a parameter change below 0.1 % changes the motion; no model follows such a record to its "
    "end"
)
DIVERGED = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise: beyond some time the free runs take another "
    "course than the records; within a few periods the model follows"
)

LOUDER = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise of the fitted ones: their readings are noisier, "
    "for what is left cannot be predicted from its past (an instrument's noise often grows with its range)"
)


OFFSET = (
    "on the test records {:.3g} {} are left, {:.3g} times the noise, and most of it is a constant of each record ({}): "
    "a sensor whose zero is another one in each record, by drift or because it is zeroed anew, is in no model; take "
    "each record's own zero off its readings"
)
CONSTANT = 0.5
"""Share of the squares of an error that its mean has, from which on it is a constant."""


class HoldoutFinding(NamedTuple):
    """Why the test records are missed, and whether that contradicts the verdict."""

    note: str
    is_gap: bool


def explain_holdout_residual(
    error: Gain,
    problem: Problem,
    tests: tuple[FitRecord, ...],
    hypothesis: Hypothesis,
    noise: NoiseModel | None = None,
) -> HoldoutFinding | None:
    """Find out why the test records are missed.

    Args:
        error: Free-run errors on the test records.
        problem: Whole records that were fitted.
        tests: Test records.
        hypothesis: The final model, fitted to all records of `problem`.
        noise: Noise of the output of `error` on the fitted records; None: it is not asked whether it is louder here.

    Returns:
        None where the error is what noise, a converter's steps and allowed misfit leave.
    """
    limits = problem.thresholds.verification
    rounding = problem.step(error.output) / np.sqrt(
        12.0
    )  # with much noise it is a part of that, else it is beside it
    noisy = max(error.noise_floor, rounding)
    most = limits.missed_ratio * float(np.hypot(noisy, np.sqrt(problem.allowed.get(error.output, 0.0))))
    if not error.after > most:
        return None
    values = error.after, error.unit, error.after / error.noise_floor
    there = replace(problem, records=tests)
    alone = _moved_to(there, hypothesis)
    if alone is not None and (count := count_unpredictable(there, alone)):
        return HoldoutFinding(UNPREDICTABLE.format(*values, count, len(tests)), False)
    if noise is not None and alone is not None and _is_louder_noise(alone, there, error.output, noise):
        constants = _describe_constants(_free_run_errors(alone, there, error.output), there, error)
        if constants:
            return HoldoutFinding(OFFSET.format(*values, constants), True)
        return HoldoutFinding(LOUDER.format(*values), False)
    joint = _fit_jointly(problem, tests, hypothesis)
    if joint is not None:
        here, beside = _divided(joint, len(problem.records))
        fitted = _free_run_rms(hypothesis, problem, error.output)
        settled = _free_run_rms(here, problem, error.output) < limits.joint_fit_ratio * fitted
        if settled and _free_run_rms(beside, there, error.output) < most:
            return HoldoutFinding(UNCERTAIN.format(*values), False)
    if alone is not None and alone.states and segment_rms(there, alone) * problem.size(error.output) < most:
        return HoldoutFinding(DIVERGED.format(*values), False)
    return HoldoutFinding(MISSED.format(*values), True)


def _is_louder_noise(alone: Hypothesis, tests: Problem, output: str, noise: NoiseModel) -> bool:
    """Return whether what is left of an output on the test records has the colour of the noise and no other."""
    white = [
        noise.for_period(record.period_s).whiten(error)
        for record, error in zip(tests.records, _free_run_errors(alone, tests, output), strict=True)
    ]
    if not all(np.isfinite(one).all() for one in white):
        return False
    again = fit_noise(white)
    return again.variance > tests.thresholds.verification.unpredictable_share * again.mean_square


def _describe_constants(errors: Sequence[FloatArray], tests: Problem, error: Gain) -> str:
    """Return the mean of each record by its name where it is most of every record's error; "" where it is not."""
    means = [float(one.mean()) for one in errors]
    if not all(mean**2 > CONSTANT * np.mean(one**2) for mean, one in zip(means, errors, strict=True)):
        return ""
    told = zip(tests.records, means, strict=True)
    return ", ".join(f"{record.name}: reads {-mean:+.3g} {error.unit}" for record, mean in told)


def _moved_to(problem: Problem, hypothesis: Hypothesis) -> Hypothesis | None:
    """Return the hypothesis on other records, with its values; None where it diverges there."""
    return fit_hypothesis(
        problem,
        hypothesis.simulation,
        hypothesis.mechanisms,
        iterations=0,
        fixed_parameters=hypothesis.fixed_parameters,
    )


def _fit_jointly(problem: Problem, tests: tuple[FitRecord, ...], hypothesis: Hypothesis) -> Hypothesis | None:
    """Fit the hypothesis to fit and test records together; None where that diverges."""
    alone = _moved_to(replace(problem, records=tests), hypothesis)
    if alone is None:
        return None
    both = replace(problem, records=(*problem.records, *tests))
    starts = np.concatenate((hypothesis.starts, alone.starts))
    iterations = problem.thresholds.verification.joint_fit_iterations
    return fit_hypothesis(
        both, alone.simulation, alone.mechanisms, starts, iterations, fixed_parameters=alone.fixed_parameters
    )


def _divided(joint: Hypothesis, count: int) -> tuple[Hypothesis, Hypothesis]:
    """Return a joint fit as one of its first `count` records, and as one of the others."""
    return replace(joint, starts=joint.starts[:count]), replace(joint, starts=joint.starts[count:])


def _free_run_rms(hypothesis: Hypothesis, problem: Problem, output: str) -> float:
    """Return the RMS error of `output` over the records of `problem`; infinite where a run diverges."""
    errors = np.concatenate(_free_run_errors(hypothesis, problem, output))
    rms = float(np.sqrt(np.mean(errors**2)))
    return rms if np.isfinite(rms) else np.inf


def _free_run_errors(hypothesis: Hypothesis, problem: Problem, output: str) -> list[FloatArray]:
    """Return the error (n,) of `output` in each record of `problem`; not finite from where a run diverges."""
    errors = []
    for index, record in enumerate(problem.records):
        start = np.atleast_2d(hypothesis.start(index))
        run = hypothesis.simulation.predict(record.stimulus, hypothesis.values_of(index), start)
        errors.append((run.outputs[output][0] - record.measured[output])[record.first :])
    return errors
