"""A race of hypotheses: all starts a few steps, the better half to the end; none may spend more than a lap costs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.basin_search import past_kinks
from rtctl.diagnosis.nominal_fit.initial_states import at_better_starts
from rtctl.diagnosis.problem.fit import fit_hypothesis, polish
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.work_budget import WorkBudget

FIRST_LAP = 6
SECOND_LAP = 12
LAST_LAP = 40
SECOND = 8
"""Sets that enter the second lap."""
PROMISING = 2
"""Others that enter it because a linear step would take them further than any: what bends is slow at first."""
LAST = 4
FINISHED = 3
"""Of those, sets that are fitted to all samples where the laps before took a glance at a few."""
SHORTER = (0.1, 0.0)
"""Of a step that ended above its parent, one after the other: near a fold the linear estimate jumps to another branch,
and stays there."""
FURTHER_LAPS = 2
"""Of those near the best that are still on their way: along a narrow, bent valley many steps are short."""
IN_CONTENTION = 1.5
"""Times the lowest cost."""
COULD_WIN = 3.0
"""The same, of one that a linear step promises to take to the front: a rival that is not at its end would be none."""
FORMS = 2
OTHER_FORM = 10.0
"""Times the lowest cost, of another form of a set that goes to the end: so many of them go with it."""
LEADING = 1.1
"""Times the lowest cost: of these, what has kinks is fitted past them."""
DONE = 1e-3
"""Of the cost, that one more step would take off it at most."""
Key = tuple[frozenset[str], str]
"""A set, and the form of what was added to it."""
HOPELESS = 30.0
"""Times the cost of the best after the first lap."""


class Candidate(NamedTuple):
    """Where a fit starts."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    starts: FloatArray
    still: frozenset[str]
    neutral: Simulation
    """The same where the added mechanism does not act yet."""
    parent: Hypothesis
    """That it is added to: a fit cannot be worse, unless it went astray."""
    form: str = ""
    """Of the added mechanism: another form of it is a rival to the end."""

    def shorter(self, step: float) -> Candidate:
        """From a part of the step away from the parent."""
        values, neutral = (
            np.array([one.value for one in simulation.parameters])
            for simulation in (self.simulation, self.neutral)
        )
        starts = step * self.starts
        starts[:, : self.parent.starts.shape[1]] += (1.0 - step) * self.parent.starts
        return self._replace(
            simulation=self.simulation.with_values(neutral + step * (values - neutral)), starts=starts
        )


def halve_successively(
    problem: Problem,
    runners: Sequence[Candidate],
    report: Callable[[str], None],
    budget: WorkBudget | None = None,
) -> list[Hypothesis]:
    """Of each set its best fit, lowest cost first; the first ones are fitted to the end, and to all samples, if
    `budget` lasts.
    """
    return best_of_each_set(_to_the_end(problem, runners, report, budget or WorkBudget.of(np.inf)))


def _to_the_end(
    problem: Problem, runners: Sequence[Candidate], report: Callable[[str], None], budget: WorkBudget
) -> list[Hypothesis]:
    """Of each form of each set its best fit."""
    problem = problem.until(budget)
    glance = problem.glance
    first: dict[Key, list[Hypothesis]] = {}
    parents: dict[int, float] = {}
    for runner in runners:
        if budget.spent:
            break
        report(" + ".join(runner.mechanisms))
        problem.cancellation.raise_if_cancelled()
        parent = runner.parent
        if id(parent) not in parents:
            parents[id(parent)] = parent.cost if glance is problem else _cost_there(glance, parent)
        found = _no_worse(glance, runner, parents[id(parent)])
        if found is not None:
            first.setdefault((frozenset(runner.mechanisms), runner.form), []).append(found)
    leaders = {key: min(ones, key=_cost) for key, ones in first.items()}
    ahead = _in_reach(_sorted(leaders.values()), SECOND)
    going = {key: one for key, one in leaders.items() if _among(one, ahead)}
    least = min((one.promised for one in ahead), default=np.inf)
    going |= _promising({key: ones for key, ones in first.items() if key not in going}, least)
    for key, one in sorted(going.items(), key=lambda item: item[1].cost):
        if not budget.spent:
            leaders[key] = min(leaders[key], _further(glance, one, SECOND_LAP), key=_cost)
    field = _sorted(leaders.values())
    last = _in_reach(field, LAST)
    last += _in_another_form(field, last)
    if glance is not problem:  # costs of few samples and of all cannot be compared
        finished = [one for one in (_on_all(problem, each) for each in last[:FINISHED]) if one is not None]
        return _sorted([*finished, *_slow_ones(problem, runners, finished)])
    gone = [one if budget.spent else _to_its_end(problem, one) for one in last]
    for _ in range(FURTHER_LAPS):
        least = min((one.cost for one in gone), default=0.0)
        on = [_in_contention(one, least) and one.promised < (1.0 - DONE) * one.cost for one in gone]
        if not any(on):
            break
        gone = [
            _to_its_end(problem, one) if more and not budget.spent else one
            for one, more in zip(gone, on, strict=True)
        ]
    near = LEADING * min((one.cost for one in gone), default=0.0)
    gone = [past_kinks(problem, one) if one.cost < near and not budget.spent else one for one in gone]
    return _sorted([*gone, *(one for one in field if not _among(one, last))])


def _begun(problem: Problem, runner: Candidate) -> Hypothesis | None:
    return fit_hypothesis(
        problem, runner.simulation, runner.mechanisms, runner.starts, FIRST_LAP, still=runner.still
    )


def _cost_there(problem: Problem, one: Hypothesis) -> float:
    """Of these records, where it was fitted to more of them; infinite where it diverges."""
    same = fit_hypothesis(problem, one.simulation, one.mechanisms, one.starts, 0, still=one.still)
    return np.inf if same is None else same.cost


def _no_worse(problem: Problem, runner: Candidate, most: float) -> Hypothesis | None:
    """Begun with a shorter step, at last with none, where it ended above `most`, its parent's cost."""
    best = _begun(problem, runner)
    for step in SHORTER:
        if best is not None and best.cost <= most:
            break
        again = _begun(problem, runner.shorter(step))
        best = min((one for one in (best, again) if one is not None), key=_cost, default=None)
    return best


def _to_its_end(problem: Problem, one: Hypothesis) -> Hypothesis:
    """From where its records fit best, with every shape that they can determine."""
    one = at_better_starts(problem, one)
    return _better(one, polish(problem, one, LAST_LAP))


def _on_all(problem: Problem, one: Hypothesis) -> Hypothesis | None:
    """To the end at a glance, then on all samples."""
    end = past_kinks(problem.glance, _to_its_end(problem.glance, one))
    return fit_hypothesis(problem, end.simulation, end.mechanisms, end.starts, FIRST_LAP, still=end.still)


def _slow_ones(
    problem: Problem, runners: Sequence[Candidate], finished: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """What a glance at the records' beginnings does not show: the best parent's set with each slow mechanism, fitted to
    all samples, to its end where it is near the best.
    """
    slow: list[tuple[str, Candidate]] = []
    for runner in runners:
        added = [one for one in runner.simulation.mechanisms if one.id not in runner.parent.mechanisms]
        if len(added) == 1 and added[0].slow:
            slow.append((added[0].id, runner))
    least = min((runner.parent.cost for _, runner in slow), default=0.0)
    first = {name: runner for name, runner in slow[::-1] if runner.parent.cost == least}
    begun = [one for one in (_no_worse(problem, each, least) for each in first.values()) if one is not None]
    least = min((one.cost for one in (*finished, *begun)), default=0.0)
    near = [one.cost < IN_CONTENTION * least for one in begun]
    return [
        _better(one, polish(problem, one, SECOND_LAP)) if on else one
        for one, on in zip(begun, near, strict=True)
    ]


def _in_contention(one: Hypothesis, least: float) -> bool:
    return one.cost < (COULD_WIN if one.promised < least else IN_CONTENTION) * least


def _in_reach(field: Sequence[Hypothesis], most: int) -> list[Hypothesis]:
    return [one for one in field[:most] if one.cost <= HOPELESS * field[0].cost]


def _in_another_form(field: Sequence[Hypothesis], last: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Further ones of `field` of the same sets as `last`: what acts in another way may need a shape that is still at
    its default, and is far behind until it moves.
    """
    sets = [frozenset(one.mechanisms) for one in last]
    others = (one for one in field if not _among(one, last) and frozenset(one.mechanisms) in sets)
    return [one for one in others if one.cost < OTHER_FORM * last[0].cost][:FORMS]


def _promising(begun: Mapping[Key, Sequence[Hypothesis]], least: float) -> dict[Key, Hypothesis]:
    """The best starts by what a linear step promises, if that is below `least`."""
    best = {key: min(ones, key=lambda one: one.promised) for key, ones in begun.items()}
    promising = [key for key, one in best.items() if one.promised < least]
    return {key: best[key] for key in sorted(promising, key=lambda key: best[key].promised)[:PROMISING]}


def _among(one: Hypothesis, others: Sequence[Hypothesis]) -> bool:
    return any(one is other for other in others)


def _further(problem: Problem, one: Hypothesis, laps: int) -> Hypothesis:
    one = at_better_starts(problem, one)
    return _better(
        one, fit_hypothesis(problem, one.simulation, one.mechanisms, one.starts, laps, still=one.still)
    )


def _better(one: Hypothesis, found: Hypothesis | None) -> Hypothesis:
    return found if found is not None and found.cost <= one.cost else one


def best_of_each_set(field: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of each set the first."""
    found: dict[frozenset[str], Hypothesis] = {}
    for one in field:
        found.setdefault(frozenset(one.mechanisms), one)
    return list(found.values())


def _sorted(field: Iterable[Hypothesis]) -> list[Hypothesis]:
    return sorted(field, key=_cost)


def _cost(one: Hypothesis) -> float:
    return one.cost
