"""The beginnings of records, up to where the free runs of the nominal model part from them, or might.

Between two motions, those of a jump or of two wells, a model with any error goes the other way sooner or later. What
follows says nothing of the error; before that a free run is as good a judge as any, and what is missing shows. Where
next to nothing of a parameter decides which way a run goes, a fit that happens to go the right way is held there by
that one moment, and can move no parameter any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.multiple_shooting_start import FAR, approached, misfit
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord

PARTED = 0.5
"""Of a record's RMS about its mean: a residual that is larger over a period has gone another way."""
LEAST_PERIODS = 12.0
"""Of a beginning; a record that parts before is left out."""
LEAST_SHARE = 0.05
"""Of all samples, that the beginnings must hold together."""
MOST = 0.5
"""Of the squared error, after the beginnings: then they say more of the model than whole records do, far off or not."""
TURNS = 3
"""Each fits the beginnings and finds how far that reaches."""
PARTING = 3.0
"""Times the RMS of a usual period of the same record."""
LATE = 0.05
"""Of its periods, at most, that a beginning ends with and leaves out."""
UNDECIDED = 1e5
"""Of an output's size, by a parameter that changes by as much as matters: steeper, what follows is not foreseeable. Of
twenty bistable devices of the blind generator three have such records, and of the others the steepest has 8e4."""
FORESEEN = 1e3
"""The same where a record that gets steeper than `UNDECIDED` is cut."""


def beginnings(problem: Problem, nominal: Hypothesis) -> tuple[Problem, Hypothesis] | None:
    """The data that the nominal model follows, and the nominal model fitted to them; None where it follows all, or
    next to none.
    """
    if not nominal.states:
        return None
    if misfit(problem, nominal) < FAR and _share_after(problem, nominal) < MOST:
        return None
    found = as_far_as_followed(problem, nominal.simulation, nominal.mechanisms)
    if found is None or found[0].samples == problem.samples:
        return None
    short, followed = found
    kept = _before_parting(problem, short, followed)
    again = _fitted_to(short, followed.simulation, followed.mechanisms, kept)
    return found if again is None else again


def foreseeable(problem: Problem, nominal: Hypothesis) -> Problem:
    """The beginnings of records up to where what follows is not foreseeable; the same data where all of it is, or next
    to none.
    """
    kept = [
        reach if reach >= record.first + LEAST_PERIODS * period_of(problem, record) else 0
        for record, reach in zip(problem.records, _foreseen(problem, nominal), strict=True)
    ]
    records = tuple(
        record.truncate(count) for record, count in zip(problem.records, kept, strict=True) if count
    )
    short = replace(problem, records=records)
    return short if LEAST_SHARE * problem.samples <= short.samples < problem.samples else problem


def unforeseeable(problem: Problem, hypothesis: Hypothesis) -> int:
    """Records of which the end is."""
    return sum(
        reach < record.samples
        for record, reach in zip(problem.records, _foreseen(problem, hypothesis), strict=True)
    )


def _foreseen(problem: Problem, hypothesis: Hypothesis) -> list[int]:
    """Of each record, samples up to where what follows is not foreseeable."""
    all_of_it = [record.samples for record in problem.records]
    if not hypothesis.states:
        return all_of_it
    try:
        lines = hypothesis.linearise(problem)
    except ArithmeticError:
        return all_of_it
    sizes = np.array([problem.size(name) for name in hypothesis.sensitivity.outputs])[:, None]
    found = []
    for record, line in zip(problem.records, lines, strict=True):
        steepest = np.max(np.abs(line.shared) / sizes, axis=(0, 1), initial=0.0)
        lost = np.flatnonzero(~(steepest < UNDECIDED))
        sure = np.flatnonzero(steepest[: lost[0]] < FORESEEN) if len(lost) else np.array([len(steepest) - 1])
        found.append(record.first + int(sure[-1]) + 1 if len(sure) else 0)
    return found


def as_far_as_followed(
    problem: Problem, simulation: Simulation, mechanisms: Sequence[str]
) -> tuple[Problem, Hypothesis] | None:
    """The beginnings of records that `simulation` follows, all of them perhaps, fitted to them; None: next to none."""
    best: tuple[Problem, Hypothesis] | None = None
    starts = [simulation, *approached(problem, simulation)]
    longest = max(starts, key=lambda one: sum(_followed(problem, one)))
    simulation = longest
    for _ in range(TURNS):
        kept = _followed(problem, simulation)
        found = _fitted_to(problem, simulation, mechanisms, kept)
        if found is None or (best is not None and found[0].samples <= best[0].samples):
            break
        best, simulation = found, found[1].simulation
    return best if best is not None and best[0].samples >= LEAST_SHARE * problem.samples else None


def _before_parting(problem: Problem, short: Problem, followed: Hypothesis) -> list[int]:
    """Of each record of `short`, samples; of those that are cut without last periods that leave far more than others
    of the record: there it parts already.
    """
    whole = {record.name: record.samples for record in problem.records}
    try:
        lines = followed.linearise(short)
    except ArithmeticError:
        return [record.samples for record in short.records]
    found = []
    for record, line in zip(short.records, lines, strict=True):
        period, late = period_of(problem, record), 0
        count = (record.samples - record.first) // period
        if record.samples < whole[record.name]:
            error = line.residual[:, -count * period :].reshape(-1, count, period)
            left = np.sqrt(np.mean(error**2, axis=2))
            usual = (left <= PARTING * np.median(left, axis=1, keepdims=True)).all(axis=0)
            late = int(np.argmax(usual[::-1]))
        found.append(record.samples - (late * period if late <= LATE * count else 0))
    return found


def _share_after(problem: Problem, nominal: Hypothesis) -> float:
    """Of the squared error at the fit, what follows where it parts from the records."""
    total = after = 0.0
    try:
        lines = nominal.linearise(problem)
    except ArithmeticError:
        return 0.0
    for record, line in zip(problem.records, lines, strict=True):
        for name, error in zip(nominal.sensitivity.outputs, line.residual, strict=True):
            squares = (error / problem.size(name)) ** 2
            reach = followed(error, period_of(problem, record), PARTED * float(np.std(record.measured[name])))
            total += float(squares.sum())
            after += float(squares[reach:].sum())
    return after / total if total > 0.0 else 0.0


def period_of(problem: Problem, record: FitRecord) -> int:
    """Samples of `record` in a period of the dominant motion."""
    return max(1, round(2.0 * np.pi / (problem.scales.rate * record.period_s)))


def _fitted_to(
    problem: Problem, simulation: Simulation, mechanisms: Sequence[str], kept: Sequence[int]
) -> tuple[Problem, Hypothesis] | None:
    records = tuple(
        record.truncate(count) for record, count in zip(problem.records, kept, strict=True) if count
    )
    if not records:
        return None
    short = replace(problem, records=records)
    found = fit_hypothesis(short, simulation, mechanisms)
    return None if found is None else (short, found)


def _followed(problem: Problem, simulation: Simulation) -> list[int]:
    """Of each record, samples up to where a free run parts from it; 0 where that is too soon."""
    values = np.array([one.value for one in simulation.parameters])
    return [
        _followed_of(record, simulation, values, period_of(problem, record)) for record in problem.records
    ]


def _followed_of(record: FitRecord, simulation: Simulation, values: FloatArray, period: int) -> int:
    run = simulation.predict(record.stimulus, values)
    reach = record.samples
    for name in (one for one in simulation.outputs if one in record.measured):
        measured = record.measured[name]
        error = np.nan_to_num(run.outputs[name][0] - measured, nan=np.inf, posinf=np.inf, neginf=np.inf)
        reach = min(reach, followed(error, period, PARTED * float(np.std(measured))))
    return reach if reach >= record.first + LEAST_PERIODS * period else 0


def followed(error: FloatArray, period: int, most: float) -> int:
    """Samples of `error` (n,) before the first period of which the RMS is not below `most`; all, or 0 of none."""
    count = len(error) // period
    if not count:
        return 0
    with np.errstate(over="ignore"):  # of one that runs away
        size = np.sqrt(np.mean(error[: count * period].reshape(count, period) ** 2, axis=1))
    parted = np.flatnonzero(~(size < most))
    return int(parted[0]) * period if len(parted) else len(error)
