"""A race of hypotheses: all starts a few steps, the better half to the end; none may spend more than a lap costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.budget import Budget
from rtctl.diagnosis.hypothesis import Data, Hypothesis, fitted, polished

FloatArray = NDArray[np.float64]
FIRST_LAP = 6
SECOND_LAP = 12
LAST_LAP = 40
SECOND = 8
"""Sets that enter the second lap."""
LAST = 4
FINISHED = 3
"""Of those, sets that are fitted to all samples where the laps before took a glance at a few."""
HOPELESS = 30.0
"""Times the cost of the best after the first lap."""


class Runner(NamedTuple):
    """Where a fit starts."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    starts: FloatArray
    still: frozenset[str]


def race(
    data: Data, runners: Sequence[Runner], told: Callable[[str], None], budget: Budget | None = None
) -> list[Hypothesis]:
    """Of each set its best fit, lowest cost first; the first ones are fitted to the end, and to all samples, if
    `budget` lasts.
    """
    budget, glance = budget or Budget.of(np.inf), data.glance
    first: dict[frozenset[str], list[Hypothesis]] = {}
    for runner in runners:
        if budget.spent:
            break
        told(" + ".join(runner.mechanisms))
        found = fitted(
            glance, runner.simulation, runner.mechanisms, runner.starts, FIRST_LAP, still=runner.still
        )
        if found is not None:
            first.setdefault(frozenset(runner.mechanisms), []).append(found)
    field = _sorted([min(ones, key=_cost) for ones in first.values()])
    going = _in_reach(field, SECOND)
    gone = [one if budget.spent else _further(glance, one, SECOND_LAP) for one in going]
    field = _sorted([*gone, *field[len(going) :]])
    going = _in_reach(field, LAST)
    if glance is not data:  # costs of few samples and of all cannot be compared
        return _sorted([one for one in (_on_all(data, each) for each in going[:FINISHED]) if one is not None])
    gone = [one if budget.spent else _better(one, polished(data, one, LAST_LAP)) for one in going]
    return _sorted([*gone, *field[len(going) :]])


def _on_all(data: Data, one: Hypothesis) -> Hypothesis | None:
    """To the end at a glance, then on all samples."""
    end = _better(one, polished(data.glance, one, LAST_LAP))
    return fitted(data, end.simulation, end.mechanisms, end.starts, FIRST_LAP, still=end.still)


def _in_reach(field: Sequence[Hypothesis], most: int) -> list[Hypothesis]:
    return [one for one in field[:most] if one.cost <= HOPELESS * field[0].cost]


def _further(data: Data, one: Hypothesis, laps: int) -> Hypothesis:
    return _better(one, fitted(data, one.simulation, one.mechanisms, one.starts, laps, still=one.still))


def _better(one: Hypothesis, found: Hypothesis | None) -> Hypothesis:
    return found if found is not None and found.cost <= one.cost else one


def _sorted(field: Sequence[Hypothesis]) -> list[Hypothesis]:
    return sorted(field, key=_cost)


def _cost(one: Hypothesis) -> float:
    return one.cost
