"""Bursts in the residual: a noise model is an average over whole records, and hides a rare event."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import kurtosis

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

IN_BURSTS = "comes in bursts"
BURSTS = (
    f"what is left of the {{}} {IN_BURSTS} "
    "(excess kurtosis {:.2g}, of a normal noise 0), the largest in record {} at "
    "{:.4g} s: a noise is an average that hides them. Something rare may act there; look at that place"
)


def describe_bursts(errors: Mapping[str, Sequence[FloatArray]], problem: Problem) -> list[str]:
    """Return a warning for each output whose residual comes in bursts.

    Args:
        errors: Residual (n,) of each record by output, from `simulation_errors`.
        problem: Problem with the records.
    """
    warnings: list[str] = []
    for name, series in errors.items():
        standard = [(error - error.mean()) / error.std() for error in series]
        excess = float(kurtosis(np.concatenate(standard)))
        if excess > problem.thresholds.residual.burst_excess_kurtosis:
            k = int(np.argmax([np.abs(one).max() for one in standard]))
            record = problem.records[k]
            at_s = record.period_s * (record.first + int(np.argmax(np.abs(standard[k]))))
            warnings.append(BURSTS.format(name.replace("_", " "), excess, record.name, at_s))
    return warnings


def simulation_errors(tested: TestedHypothesis, problem: Problem) -> dict[str, list[FloatArray]]:
    """Return the residual of each record's scored samples by output, (n,) in the output's unit.

    Outputs that the fit leaves nothing of, or no number, are left out. Where a misfit is allowed the result is empty:
    such a misfit has edges and follows the drive.
    """
    if problem.allowed:
        return {}
    hypothesis = tested.hypothesis
    runs = [
        hypothesis.simulation.predict(
            record.stimulus, hypothesis.values_of(k), hypothesis.start(k)[None], problem.steps_per_period
        )
        for k, record in enumerate(problem.records)
    ]
    errors = {}
    for name in hypothesis.sensitivity.outputs:
        series = [
            (run.outputs[name][0] - record.measured[name])[record.first :]
            for record, run in zip(problem.records, runs, strict=True)
        ]
        sizes = [float(np.std(error)) for error in series]
        if np.isfinite(sizes).all() and min(sizes) > 0.0:
            errors[name] = series
    return errors
