"""How far records of some inputs would set two candidates apart.

T-optimal, the rival re-fitted to old and new data: with d the difference of both predictions, S the rival's
sensitivities on the new input and I its information from the data so far, all in units of the noise,

    T = min over c of |d - S' c|^2 + c' I c = d d - d S' (S S' + I)^-1 S d

Reference: Atkinson & Fedorov, The design of experiments for discriminating between two rival models (1975), eq. 2.3.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.nominal_fit.predictability import followed_samples, period_of
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import RecordRows
from rtctl.diagnosis.screening.unknown_initial_state import has_two_wells
from rtctl.diagnosis.thresholds import NominalFitThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel

PARTED = NominalFitThresholds().diverged_rms
"""RMS difference of two predictions over a period, over the output's size, from which they are different motions."""

TURNS = 3
"""Of a rival's start, towards the other's prediction."""
FURTHEST = 1.5
"""Times the largest measured displacement: a device is not sent further on a simulation's word."""


class Pair(NamedTuple):
    """One candidate's prediction against a rival that may move, of records in units of the noise; what is each record's
    own is fitted already.
    """

    squares: float
    """d d"""
    along: FloatArray
    """(p,) S d"""
    normal: FloatArray
    """(p, p) S S'"""

    @classmethod
    def of(cls, true: FloatArray, rival: FloatArray, slopes: FloatArray, shared: int) -> Pair:
        """From predictions (n,) and the rival's slopes (q, n): of its p `shared` unknowns, then of the record's own."""
        beyond = _beyond(np.vstack((true - rival, slopes[:shared])), slopes[shared:])
        difference, apart = beyond[0], beyond[1:]
        return cls(float(difference @ difference), apart @ difference, apart @ apart.T)

    def and_also(self, other: Pair, times: int = 1) -> Pair:
        """Of these records and so many of the other's, all with unknowns of their own."""
        return Pair(
            self.squares + times * other.squares,
            self.along + times * other.along,
            self.normal + times * other.normal,
        )

    def squared(self, known: FloatArray) -> float:
        """T, with the rival's information (p, p) from the data so far."""
        normal = self.normal + known
        size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        along = self.along / size
        solved = np.linalg.pinv(normal / size[:, None] / size, rcond=1e-12, hermitian=True) @ along
        return max(0.0, self.squares - float(along @ solved))


def _beyond(rows: FloatArray, own: FloatArray) -> FloatArray:
    """What of `rows` (k, n) is orthogonal to those in `own` (m, n)."""
    size = np.sqrt(np.sum(own**2, axis=1, keepdims=True))
    _, values, basis = np.linalg.svd(own / np.where(size > 0.0, size, 1.0), full_matrices=False)
    basis = basis[values > 1e-6]
    for _ in range(2):  # once more, for what the first time leaves by rounding
        rows = rows - (rows @ basis.T) @ basis
    return rows


class Played(NamedTuple):
    """What an input would bring."""

    pairs: Mapping[tuple[int, int], Pair]
    """Of each candidate against each other one."""
    whole: bool
    """No prediction parts from the others: else only what comes before counts, and a fit may not find back after it."""

    def and_also(self, other: Played, times: int = 1) -> Played:
        """Of these records and so many of the other's."""
        pairs = {key: pair.and_also(other.pairs[key], times) for key, pair in self.pairs.items()}
        return Played(pairs, self.whole and other.whole)

    def separation(self, one: int, other: int, known: Sequence[FloatArray]) -> float:
        """[standard errors] Between two candidates, whichever is true; `known` of each: its `information`."""
        sides = ((one, other), (other, one))
        return float(np.sqrt(min(self.pairs[side].squared(known[side[1]]) for side in sides)))


def information(candidate: Hypothesis, problem: Problem, noise: Sequence[NoiseModel]) -> FloatArray:
    """(p, p) of the shared unknowns, from all records so far."""
    total = np.zeros((len(candidate.shared), len(candidate.shared)))
    for record, line in zip(problem.records, candidate.linearise(problem), strict=True):
        rows = RecordRows(
            residual=line.residual, shared=line.shared, local=line.local, directions=line.shared[:0],
            period_s=record.period_s,
        )  # fmt: skip
        flat = rows.whitened(noise)[0][1:]
        total += flat @ flat.T
    return total


def played(
    record: FitRecord, candidates: Sequence[Hypothesis], nominal: Hypothesis, problem: Problem,
    noise: Sequence[NoiseModel],
    *, settled: bool = False,
) -> Played | None:  # fmt: skip
    """`record`, of which the input is known, by all candidates; None where the device might be hurt.

    What follows where predictions part, that of `nominal` too, does not count: between two motions any difference
    decides which. `settled`: rivals begin where each comes nearest to the other, which takes some runs; else as near
    as slopes at rest tell.
    """
    outputs = candidates[0].sensitivity.outputs
    furthest = {
        n: FURTHEST * max(float(np.abs(r.measured[n]).max()) for r in problem.records) for n in outputs
    }
    tables = []
    for candidate in candidates:
        table = _table(record, candidate, _own(candidate), problem)
        if table is None or any(np.abs(table[0, o]).max() > furthest[n] for o, n in enumerate(outputs)):
            return None
        tables.append(table)
    free = nominal.simulation.predict(record.stimulus, nominal.values_of(0), rest(nominal)[None])
    runs = [*(table[0] for table in tables), np.stack([free.outputs[name][0] for name in outputs])]
    sizes = np.array([excursion(problem, name) for name in outputs])
    end = together(np.stack(runs), sizes, period_of(problem, record))
    count = record.samples
    models = [model.for_period(record.period_s) for model in noise]

    def whitened(table: FloatArray) -> FloatArray:
        used = table[:, :, : end or count]  # apart from the start on: by an offset, which a fit follows
        made = np.stack([model.whiten(used[:, o]) for o, model in enumerate(models)], axis=1)
        return made.reshape(len(made), -1)

    white, pairs = [whitened(table) for table in tables], {}
    for i, j in itertools.permutations(range(len(candidates)), 2):
        rival, shared = white[j], len(candidates[j].shared)
        if settled:
            rival = _begun_like(white[i][0], rival, candidates[j], record, problem, whitened)
        pairs[i, j] = Pair.of(white[i][0], rival[0], rival[1:], shared)
    return Played(pairs, end == count)


def _own(candidate: Hypothesis) -> FloatArray:
    """A new record's own unknowns, in units: at rest, the rest as in the first record."""
    return np.append(rest(candidate), candidate.starts[0, candidate.states :])


def _table(record: FitRecord, candidate: Hypothesis, own: FloatArray, problem: Problem) -> FloatArray | None:
    """(1 + p + q, outputs, n): what it predicts, and its slopes; None where it diverges."""
    line = candidate.sensitivity.linearise(record, candidate.shared, own, problem.steps_per_period)
    return None if line is None else np.concatenate((line.residual[None], line.shared, line.local))


def _begun_like(
    true: FloatArray, rival: FloatArray, candidate: Hypothesis, record: FitRecord, problem: Problem,
    whitened: Callable[[FloatArray], FloatArray],
) -> FloatArray:  # fmt: skip
    """The `rival`'s predictions and slopes (1 + p + q, n) from the own unknowns at which it comes nearest to `true`
    (n,).
    """
    own, shared = _own(candidate), len(candidate.shared)
    for _ in range(TURNS):
        along = rival[1 + shared :]
        if not len(along):
            break
        step = np.linalg.lstsq(along.T, true - rival[0], rcond=1e-9)[0]
        there = own + step * candidate.sensitivity.state_scale
        made = _table(record, candidate, there, problem)
        moved = whitened(made) if made is not None else None
        if moved is None or np.sum((true - moved[0]) ** 2) >= np.sum((true - rival[0]) ** 2):
            break
        own, rival = there, moved
    return rival


def together(predicted: FloatArray, sizes: FloatArray, period: int) -> int:
    """Samples up to where predictions (candidates, outputs, n) part, by their RMS over a period.

    Against `sizes` (outputs,) of the readings so far or that of the predictions, whichever is larger.
    """
    apart = np.nan_to_num(predicted, nan=np.inf, posinf=np.inf, neginf=-np.inf)
    with np.errstate(invalid="ignore"):
        spread = np.nan_to_num(apart.max(axis=0) - apart.min(axis=0), nan=np.inf, posinf=np.inf)
    moving = predicted[:-1].std(axis=2).max(axis=0)
    reach = [
        followed_samples(one, period, PARTED * float(max(size, own)))
        for one, size, own in zip(spread, sizes, moving, strict=True)
    ]
    return min(reach)


def excursion(problem: Problem, output: str) -> float:
    """RMS of the readings about each record's mean."""
    readings = [record.measured[output][record.first :] for record in problem.records]
    count = sum(len(one) for one in readings)
    return float(np.sqrt(sum(len(one) * float(np.var(one)) for one in readings) / count))


def rest(candidate: Hypothesis) -> FloatArray:
    """State (states,): zero, or where the first record began: a bistable beam rests in a well."""
    start = np.zeros(candidate.states)
    if has_two_wells(candidate.simulation):
        start[0] = candidate.starts[0][0]
    return start
