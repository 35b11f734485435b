"""A fit past kinks: where dry friction stops a motion, the cost has a valley for each cycle in which that may happen.

From amplitudes a little smaller and larger, fits end in other valleys; the lowest is taken, and so on from there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem

FACTORS = (0.8, 0.9, 0.96, 1.04, 1.1, 1.25)
"""Of the kinked amplitudes."""
HOPS = 4
LAPS = 12
"""Of a fit from there."""
LOWER = 1e-3
"""Of the cost: a valley that is lower by less is as good."""


def past_kinks(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """The same set in the lowest valley that is found; as it is where none of its parameters is kinked."""
    if not _kinked(hypothesis).any():
        return hypothesis
    for _ in range(HOPS):
        found = [_from(problem, hypothesis, factor) for factor in FACTORS if not problem.enough()]
        best = min((one for one in found if one is not None), key=lambda one: one.cost, default=hypothesis)
        if best.cost > (1.0 - LOWER) * hypothesis.cost:
            break
        hypothesis = best
    return hypothesis


def _kinked(hypothesis: Hypothesis) -> NDArray[np.bool_]:
    """(parameters,) of the simulation."""
    return np.array([one.declared.kinked and not one.fixed for one in hypothesis.simulation.parameters])


def _from(problem: Problem, hypothesis: Hypothesis, factor: float) -> Hypothesis | None:
    """Fitted from kinked amplitudes that are `factor` times as large."""
    parameters = hypothesis.simulation.parameters
    values = np.where(_kinked(hypothesis), factor, 1.0) * [one.value for one in parameters]
    within = np.clip(values, [one.low for one in parameters], [one.high for one in parameters])
    start = hypothesis.simulation.with_values(within)
    return fit_hypothesis(problem, start, hypothesis.mechanisms, hypothesis.starts, LAPS, hypothesis.still)
