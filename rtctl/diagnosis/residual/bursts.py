"""Whether what is left comes in bursts: a noise, which is an average over whole records, hides a rare event."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import kurtosis

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis

EXCESS = 3.0
"""Kurtosis beyond a normal distribution's, of all records: that of a Laplace distribution."""
BURSTS = (
    "what is left of the {} comes in bursts (excess kurtosis {:.2g}, of a normal noise 0), the largest in record {} at "
    "{:.4g} s: a noise is an average that hides them. Something rare may act there; look at that place"
)


def bursts(left: Mapping[str, Sequence[FloatArray]], problem: Problem) -> list[str]:
    """Warnings, of the `leftovers` of the records of `data`."""
    said: list[str] = []
    for name, errors in left.items():
        standard = [(error - error.mean()) / error.std() for error in errors]
        excess = float(kurtosis(np.concatenate(standard)))
        if excess > EXCESS:
            k = int(np.argmax([np.abs(one).max() for one in standard]))
            record = problem.records[k]
            at_s = record.period_s * (record.first + int(np.argmax(np.abs(standard[k]))))
            said.append(BURSTS.format(name.replace("_", " "), excess, record.name, at_s))
    return said


def leftovers(examined: TestedHypothesis, problem: Problem) -> dict[str, list[FloatArray]]:
    """By output, what a fit leaves of each record's scored samples, (n,) in units; without outputs that it leaves
    nothing of, or no number. Nothing where a misfit is allowed, which has edges and goes with the drive.
    """
    if problem.allowed:
        return {}
    hypothesis = examined.hypothesis
    runs = [
        hypothesis.simulation.predict(
            record.stimulus, hypothesis.values_of(k), hypothesis.start(k)[None], problem.steps_per_period
        )
        for k, record in enumerate(problem.records)
    ]
    found = {}
    for name in hypothesis.sensitivity.outputs:
        errors = [
            (run.outputs[name][0] - record.measured[name])[record.first :]
            for record, run in zip(problem.records, runs, strict=True)
        ]
        sizes = [float(np.std(error)) for error in errors]
        if np.isfinite(sizes).all() and min(sizes) > 0.0:
            found[name] = errors
    return found
