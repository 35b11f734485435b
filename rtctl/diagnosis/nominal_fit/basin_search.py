"""A search over the basins of a cost with kinks: where dry friction stops a motion, each cycle may have its own valley.

Fits from slightly smaller and larger amplitudes end in other valleys; the lowest is taken, and so on from there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem


def search_basins(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """Return the same set in the lowest valley that is found; unchanged where no parameter is kinked."""
    if not _kinked(hypothesis).any():
        return hypothesis
    limits = problem.thresholds.nominal_fit
    for _ in range(limits.basin_rounds):
        fits = [
            _fit_from(problem, hypothesis, factor) for factor in limits.basin_factors if not problem.enough()
        ]
        lowest = min((one for one in fits if one is not None), key=lambda one: one.cost, default=hypothesis)
        if lowest.cost > (1.0 - limits.basin_improvement) * hypothesis.cost:
            break
        hypothesis = lowest
    return hypothesis


def _kinked(hypothesis: Hypothesis) -> NDArray[np.bool_]:
    """Return which parameters (p,) of the simulation make kinks."""
    return np.array([one.declared.kinked and not one.fixed for one in hypothesis.simulation.parameters])


def _fit_from(problem: Problem, hypothesis: Hypothesis, factor: float) -> Hypothesis | None:
    """Fit from kinked amplitudes that are `factor` times as large; None where that diverges."""
    parameters = hypothesis.simulation.parameters
    values = np.where(_kinked(hypothesis), factor, 1.0) * [one.value for one in parameters]
    within = np.clip(values, [one.low for one in parameters], [one.high for one in parameters])
    start = hypothesis.simulation.with_values(within)
    iterations = problem.thresholds.nominal_fit.basin_iterations
    return fit_hypothesis(
        problem, start, hypothesis.mechanisms, hypothesis.starts, iterations, hypothesis.fixed_parameters
    )
