"""Where records may have begun: a fit moves initial states downhill, and dry friction makes many valleys of them.

From a first reading that is off by more than the band in which friction holds, the motion comes to rest elsewhere, and
no small step of the state leads back. Other starts are tried for each record alone: in all else it is the same fit.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.oscillator.initial_state import estimate_initial_state
from rtctl.identification.oscillator.weak_form import choose_half_width

WORTH_MOVING = 1e-3
"""Of the cost, that other starts take off it."""


def at_better_starts(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """The same set and parameters, each record from the start that fits it best; as it is if that is hardly better."""
    if not hypothesis.simulation.state:
        return hypothesis
    starts, gained = hypothesis.starts.copy(), 0.0
    for index in range(len(problem.records)):
        states = _candidates(problem, hypothesis, index)
        costs = costs_of(problem, hypothesis, index, states)
        best = int(np.argmin(costs))
        starts[index, : hypothesis.states] = states[best]
        gained += costs[0] - costs[best] if np.isfinite(costs[0]) else 0.0
    if not gained > WORTH_MOVING * hypothesis.cost:
        return hypothesis
    found = fit_hypothesis(problem, hypothesis.simulation, hypothesis.mechanisms, starts, 0, hypothesis.still)
    return found if found is not None and found.cost < hypothesis.cost else hypothesis


def _candidates(problem: Problem, hypothesis: Hypothesis, index: int) -> FloatArray:
    """(starts, states): the fitted one, zero, what the first readings tell; the first and the last at rest, too."""
    fitted_start, record = hypothesis.start(index), problem.records[index]
    found = [fitted_start, np.zeros_like(fitted_start)]
    if record.first == 0:
        width_s = choose_half_width(problem.records, problem.scales.rate)
        found.append(estimate_initial_state(record, 0, width_s, hypothesis.simulation.state))
    moving = [name != "displacement" for name in hypothesis.simulation.state]
    resting = [np.where(moving, 0.0, start) for start in (found[0], *found[2:])]
    return np.array([*found, *resting])


def costs_of(problem: Problem, hypothesis: Hypothesis, index: int, states: FloatArray) -> FloatArray:
    """(starts,) of one record, of which `states` are (starts, states): infinite where a run diverges, all of them where
    no sensible step resolves one.
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
