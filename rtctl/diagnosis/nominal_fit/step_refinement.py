"""Integration steps so fine that their error does not matter.

Near a ridge between two wells, or over many periods of a light damping, the steps that suit most records leave more
than the noise does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.progressive_fit import fit_progressively
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem


def refine_nominal(problem: Problem, nominal: Hypothesis) -> tuple[Problem, Hypothesis]:
    """Refine the steps for the nominal model, and fit records on another branch progressively."""
    return refine_steps(problem, fit_progressively(problem, nominal), fit_progressively)


def refine_steps(
    problem: Problem,
    hypothesis: Hypothesis,
    improve: Callable[[Problem, Hypothesis], Hypothesis] = lambda problem, hypothesis: hypothesis,
) -> tuple[Problem, Hypothesis]:
    """Double the steps a period until they are not the error of a fit.

    Args:
        problem: Records that were fitted.
        hypothesis: The fit.
        improve: Applied to the fit with each number of steps.

    Returns:
        The problem with enough steps (itself where it has them), and the fit with these.
    """
    limits = problem.thresholds.nominal_fit
    while (
        problem.steps_per_period is not None
        and _step_error(problem, hypothesis) > limits.step_error_share * hypothesis.cost
    ):
        steps = 2.0 * problem.steps_per_period
        problem = replace(problem, steps_per_period=steps if steps <= limits.max_steps_per_period else None)
        refitted = fit_hypothesis(
            problem,
            hypothesis.simulation,
            hypothesis.mechanisms,
            hypothesis.starts,
            fixed_parameters=hypothesis.fixed_parameters,
        )
        hypothesis = improve(problem, refitted) if refitted is not None else hypothesis
    return problem, hypothesis


def _step_error(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return what the steps add to the outputs, on the scale of the cost; infinite where fine steps diverge."""
    total = 0.0
    for index, record in enumerate(problem.records):
        lanes = (hypothesis.values_of(index)[None], hypothesis.start(index)[None])
        coarse = hypothesis.simulation.predict(record.stimulus, *lanes, problem.steps_per_period)
        fine = hypothesis.simulation.predict(record.stimulus, *lanes)
        for name in hypothesis.sensitivity.outputs:
            error = (coarse.outputs[name] - fine.outputs[name])[0, record.first :] / problem.size(name)
            total += 0.5 * float(error @ error)
    return total if np.isfinite(total) else np.inf
