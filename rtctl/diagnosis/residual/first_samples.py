"""Residual tests of sets that a search compares: what fails in the first samples needs no test on all of them.

The directions of a whole catalogue along long records take as long as the fits of all single causes to them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests


def run_search_tests(hypothesis: Hypothesis, problem: Problem, ids: Sequence[str]) -> TestedHypothesis:
    """Run the residual tests on the first samples of long records, and on all where the hypothesis may pass.

    Args:
        hypothesis: Fitted hypothesis, at its optimum.
        problem: Problem that it was fitted to.
        ids: Ids of the mechanisms in whose directions it may be wrong.

    Raises:
        ArithmeticError: if the optimum is at the edge of divergence.
    """
    initial = problem.initial_part(problem.thresholds.residual.first_samples)
    if initial is not problem and is_typical(initial, hypothesis, problem):
        tested = run_residual_tests(hypothesis, initial, ids)
        if tested.p_value < problem.thresholds.search.almost_passing_p:
            return tested
    return run_residual_tests(hypothesis, problem, ids)


def is_typical(part: Problem, hypothesis: Hypothesis, whole: Problem) -> bool:
    """Return whether `hypothesis`, fitted to `whole`, leaves on `part` of it its share of the residual.

    Records whose motion grows slowly show little of what is wrong in their first samples.
    """
    left = 0.0
    for linearised in hypothesis.linearise(part):
        for name, residual in zip(hypothesis.sensitivity.outputs, linearised.residual, strict=True):
            left += float(np.sum(residual**2)) / whole.size(name) ** 2
    share = whole.thresholds.residual.typical_share
    return left / part.samples > share * 2.0 * hypothesis.cost / whole.samples
