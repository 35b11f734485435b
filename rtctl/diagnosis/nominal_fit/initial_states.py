"""Other initial states of single records: dry friction makes many valleys of them, and a fit only moves downhill.

From a first reading that is off by more than the band in which friction holds, the motion comes to rest elsewhere, and
no small step of the state leads back. Other starts are tried for each record alone; all else of the fit is kept.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.regression.initial_state import estimate_initial_state
from rtctl.identification.regression.weak_form import choose_half_width


def improve_initial_states(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """Return the same set with the initial state that fits each record best; unchanged if that is hardly better."""
    if not hypothesis.simulation.state:
        return hypothesis
    starts, gained = hypothesis.starts.copy(), 0.0
    for index in range(len(problem.records)):
        states = _candidate_states(problem, hypothesis, index)
        costs = costs_of_states(problem, hypothesis, index, states)
        best = int(np.argmin(costs))
        starts[index, : hypothesis.states] = states[best]
        gained += costs[0] - costs[best] if np.isfinite(costs[0]) else 0.0
    if not gained > problem.thresholds.nominal_fit.start_improvement * hypothesis.cost:
        return hypothesis
    better = fit_hypothesis(
        problem, hypothesis.simulation, hypothesis.mechanisms, starts, 0, hypothesis.fixed_parameters
    )
    return better if better is not None and better.cost < hypothesis.cost else hypothesis


def _candidate_states(problem: Problem, hypothesis: Hypothesis, index: int) -> FloatArray:
    """Return (starts, states): the fitted state, zero, the first readings; the first and the last of them at rest."""
    fitted, record = hypothesis.start(index), problem.records[index]
    states = [fitted, np.zeros_like(fitted)]
    if record.first == 0:
        width_s = choose_half_width(problem.records, problem.scales.rate)
        states.append(estimate_initial_state(record, 0, width_s, hypothesis.simulation.state))
    moving = [name != "displacement" for name in hypothesis.simulation.state]
    resting = [np.where(moving, 0.0, state) for state in (states[0], *states[2:])]
    return np.array([*states, *resting])


def costs_of_states(problem: Problem, hypothesis: Hypothesis, index: int, states: FloatArray) -> FloatArray:
    """Return the cost of one record from each of several initial states.

    Args:
        problem: Records that were fitted.
        hypothesis: Its parameters are kept.
        index: Position of the record.
        states: (starts, states) in units.

    Returns:
        (starts,); infinite where a run diverges, all of them where no sensible step resolves one.
    """
    record = problem.records[index]
    values = np.tile(hypothesis.values_of(index), (len(states), 1))
    try:
        run = hypothesis.simulation.predict(record.stimulus, values, states, problem.steps_per_period)
    except ValueError:
        return np.full(len(states), np.inf)
    costs = np.zeros(len(states))
    for name in hypothesis.sensitivity.outputs:
        error = (run.outputs[name] - record.measured[name])[:, record.first :] / problem.size(name)
        with np.errstate(over="ignore", invalid="ignore"):
            costs += 0.5 * np.sum(error**2, axis=1)
    return np.where(np.isfinite(costs), costs, np.inf)
