"""A record that a fit follows less well than the others, caught up with from its beginning.

Near a fold one record jumps to another branch, or crosses a barrier at another moment, and no small step of any
parameter leads back. The others tell the parameters, its beginning tells its start; from there on the fit takes in ever
more of it, so that it never has far to go.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.initial_states import at_better_starts, costs_of
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem

STANDS_OUT = 1.2
"""Times what is left in the others, by RMS: their median."""
BEGINNING = 1.0 / 16.0
"""Of the record; then twice as much each time, or half as much more where that was too much."""
LEAST_STEP = 1.0 / 64.0
MOST_LATE = 8
"""Times that a record is caught up with."""
MOST_FITS = 12
ITERATIONS = 12
"""Of a fit that takes in more of it; the last one goes to its end."""
WORTH_IT = 1e-3
"""Of the cost."""


def caught_up(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """The same set, with every record that stands out followed if that lowers the cost; else as it is."""
    if not hypothesis.states or len(problem.records) < 2:
        return hypothesis
    for _ in problem.records[:MOST_LATE]:
        late = _standing_out(problem, hypothesis)
        found = _followed(problem, hypothesis, late) if late is not None else None
        if found is None or found.cost > (1.0 - WORTH_IT) * hypothesis.cost:
            break
        hypothesis = found
    return hypothesis


def _standing_out(problem: Problem, hypothesis: Hypothesis) -> int | None:
    """The record that is followed worst, if that is clearly less well than the others."""
    costs = [
        costs_of(problem, hypothesis, index, hypothesis.start(index)[None])[0]
        for index in range(len(problem.records))
    ]
    left = np.sqrt(np.array(costs) / [record.samples - record.first for record in problem.records])
    worst = int(np.argmax(left))
    return worst if left[worst] > STANDS_OUT * np.median(np.delete(left, worst)) else None


def _followed(problem: Problem, hypothesis: Hypothesis, late: int) -> Hypothesis | None:
    """Fitted with ever more of the `late` record; None where not even its beginning is followed."""
    nominal = _without(problem, hypothesis, late)
    reached, part = 0.0, BEGINNING
    for _ in range(MOST_FITS):
        if nominal is None or reached == 1.0:
            break
        records = tuple(
            record if k != late else record.truncate(_samples(record.samples, record.first, part))
            for k, record in enumerate(problem.records)
        )
        more = replace(problem, records=records)
        there = _fitted_from(more, nominal, ITERATIONS)
        if there is not None and _standing_out(more, there) != late:
            nominal, reached, part = there, part, min(1.0, 2.0 * part)
            continue
        if not reached or part - reached <= LEAST_STEP:
            break
        part = 0.5 * (reached + part)
    if nominal is None or not reached:
        return None
    return fit_hypothesis(
        problem, nominal.simulation, nominal.mechanisms, nominal.starts, still=nominal.still
    )


def _samples(total: int, first: int, part: float) -> int:
    """So much of what is scored."""
    return first + max(1, round(part * (total - first)))


def _without(problem: Problem, hypothesis: Hypothesis, late: int) -> Hypothesis | None:
    """Fitted to the other records; the start of the `late` one is that of `hypothesis`."""
    kept = [k for k in range(len(problem.records)) if k != late]
    others = replace(problem, records=tuple(problem.records[k] for k in kept))
    found = fit_hypothesis(
        others, hypothesis.simulation, hypothesis.mechanisms, hypothesis.starts[kept], still=hypothesis.still
    )
    if found is None:
        return None
    starts = hypothesis.starts.copy()
    starts[kept] = found.starts
    return replace(found, starts=starts)


def _fitted_from(problem: Problem, nominal: Hypothesis, iterations: int) -> Hypothesis | None:
    """From the parameters of `begun`, and its starts or better ones."""
    at = fit_hypothesis(problem, nominal.simulation, nominal.mechanisms, nominal.starts, 0, nominal.still)
    if at is None:
        return None
    at = at_better_starts(problem, at)
    return fit_hypothesis(problem, at.simulation, at.mechanisms, at.starts, iterations, at.still)
