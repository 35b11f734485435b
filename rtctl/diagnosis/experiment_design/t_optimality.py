"""T-optimality: how far records of an input would set two candidates apart.

The rival is re-fitted to old and new data. With d the difference of both predictions, S the rival's sensitivities on
the new record and I its information from the data so far, all in units of the noise, the noncentrality is

    T = min over c of |d - S' c|^2 + c' I c = d d - d S' (S S' + I)^-1 S d

and its root the separation in standard errors.

Reference: Atkinson & Fedorov, The design of experiments for discriminating between two rival models (1975), eq. 2.3.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.predictability import followed_samples, period_of
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import RecordRows
from rtctl.diagnosis.screening.unknown_initial_state import has_two_wells
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel

NOTHING = Stimulus(inputs={}, holds={}, period_s=1.0, count=2)
"""A record of which nothing is known."""


class RivalTerms(NamedTuple):
    """Terms of T for one candidate, taken as true, against a rival: sums over records, in units of the noise.

    The unknowns of each record alone are fitted already.
    """

    squares: float
    """d d: squared difference of the predictions."""
    along: FloatArray
    """S d (p,): the difference along the rival's shared sensitivities."""
    normal: FloatArray
    """S S' (p, p): the rival's information from the new records."""

    @classmethod
    def of(cls, true: FloatArray, rival: FloatArray, slopes: FloatArray, shared: int) -> RivalTerms:
        """Return the terms of one record.

        Args:
            true: Prediction (n,) of the candidate that is taken as true, whitened.
            rival: Prediction (n,) of the rival, whitened.
            slopes: Sensitivities (p + q, n) of the rival: by its p shared unknowns, then by the record's own.
            shared: Number p of shared unknowns.
        """
        beyond = _remove_span(np.vstack((true - rival, slopes[:shared])), slopes[shared:])
        difference, apart = beyond[0], beyond[1:]
        return cls(float(difference @ difference), apart @ difference, apart @ apart.T)

    def add(self, other: RivalTerms, times: int = 1) -> RivalTerms:
        """Return the terms of these records and `times` those of `other`, each with unknowns of its own."""
        return RivalTerms(
            self.squares + times * other.squares,
            self.along + times * other.along,
            self.normal + times * other.normal,
        )

    def noncentrality(self, known: FloatArray) -> float:
        """Return T, given the rival's information (p, p) from the data so far."""
        normal = self.normal + known
        size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        along = self.along / size
        solved = np.linalg.pinv(normal / size[:, None] / size, rcond=1e-12, hermitian=True) @ along
        return max(0.0, self.squares - float(along @ solved))


def _remove_span(rows: FloatArray, own: FloatArray) -> FloatArray:
    """Return the part of `rows` (k, n) that is orthogonal to the rows of `own` (m, n)."""
    size = np.sqrt(np.sum(own**2, axis=1, keepdims=True))
    _, values, basis = np.linalg.svd(own / np.where(size > 0.0, size, 1.0), full_matrices=False)
    basis = basis[values > 1e-6]
    for _ in range(2):  # once more, for what the first time leaves by rounding
        rows = rows - (rows @ basis.T) @ basis
    return rows


class Comparison(NamedTuple):
    """Each candidate against each other one, under records of one or more inputs."""

    pairs: Mapping[tuple[int, int], RivalTerms]
    """Terms by the indices of the candidate that is taken as true and of its rival."""
    whole: bool
    """Whether no prediction parts from the others. Where one does, only the part before counts, and a fit may not find
    back after it."""

    def add(self, other: Comparison, times: int = 1) -> Comparison:
        """Return the comparison under these records and `times` those of `other`."""
        pairs = {key: terms.add(other.pairs[key], times) for key, terms in self.pairs.items()}
        return Comparison(pairs, self.whole and other.whole)

    def separation(self, one: int, other: int, known: Sequence[FloatArray]) -> float:
        """Return the separation of two candidates [standard errors], the smaller one over which of them is true.

        Args:
            one: Index of a candidate.
            other: Index of another candidate.
            known: Information (p, p) of each candidate from the data so far, see `compute_information`.
        """
        sides = ((one, other), (other, one))
        return float(np.sqrt(min(self.pairs[side].noncentrality(known[side[1]]) for side in sides)))


def compute_information(candidate: Hypothesis, problem: Problem, noise: Sequence[NoiseModel]) -> FloatArray:
    """Return the Fisher information (p, p) of the shared unknowns from all records so far.

    Args:
        candidate: A fitted candidate.
        problem: Records to fit.
        noise: Noise model of each output.
    """
    total = np.zeros((len(candidate.shared), len(candidate.shared)))
    for record, line in zip(problem.records, candidate.linearise(problem), strict=True):
        rows = RecordRows(
            residual=line.residual, shared=line.shared, local=line.local, directions=line.shared[:0],
            period_s=record.period_s,
        )  # fmt: skip
        flat = rows.whitened(noise)[0][1:]
        total += flat @ flat.T
    return total


def compare_candidates(
    record: FitRecord, candidates: Sequence[Hypothesis], nominal: Hypothesis, problem: Problem,
    noise: Sequence[NoiseModel],
    *, settled: bool = False,
) -> Comparison | None:  # fmt: skip
    """Compare the predictions of all candidates for a new record.

    The part after predictions take different courses, that of the nominal model included, does not count: between two
    motions any difference is large, and says nothing of the causes.

    Args:
        record: The new record; only its input is known.
        candidates: Fitted candidates.
        nominal: The fitted nominal model, from which the next diagnosis starts.
        problem: Records to fit, their scales and the thresholds.
        noise: Noise model of each output.
        settled: Whether a rival's initial state is the one at which it comes nearest to the other candidate, which
            takes some runs; else it is estimated by the sensitivities at rest.

    Returns:
        The comparison; None where a candidate diverges, or predicts an output that might damage the device.
    """
    outputs = candidates[0].sensitivity.outputs
    tables = []
    for candidate in candidates:
        table = _predict(record, candidate, _initial_unknowns(candidate), problem)
        if table is None or _exceeds_reach(table[0], outputs, problem):
            return None
        tables.append(table)
    free = nominal.simulation.predict(record.stimulus, nominal.values_of(0), find_rest_state(nominal)[None])
    runs = [*(table[0] for table in tables), np.stack([free.outputs[name][0] for name in outputs])]
    sizes = np.array([compute_output_rms(problem, name) for name in outputs])
    most = problem.thresholds.nominal_fit.diverged_rms
    end = count_common_samples(np.stack(runs), sizes, period_of(problem, record), most)
    count = record.samples
    models = [model.for_period(record.period_s) for model in noise]

    def whiten(table: FloatArray) -> FloatArray:
        used = table[:, :, : end or count]  # apart from the start on: by an offset, which a fit follows
        made = np.stack([model.whiten(used[:, o]) for o, model in enumerate(models)], axis=1)
        return made.reshape(len(made), -1)

    white, pairs = [whiten(table) for table in tables], {}
    for i, j in itertools.permutations(range(len(candidates)), 2):
        rival, shared = white[j], len(candidates[j].shared)
        if settled:
            rival = _fit_initial_state(white[i][0], rival, candidates[j], record, problem, whiten)
        pairs[i, j] = RivalTerms.of(white[i][0], rival[0], rival[1:], shared)
    return Comparison(pairs, end == count)


def _exceeds_reach(predicted: FloatArray, outputs: Sequence[str], problem: Problem) -> bool:
    """Return whether a prediction goes further than a device is sent.

    Args:
        predicted: Prediction (outputs, n), in the outputs' units.
        outputs: Names of the outputs.
        problem: Records to fit, and the thresholds.
    """
    ratio = problem.thresholds.experiment.max_reach_ratio
    for run, name in zip(predicted, outputs, strict=True):
        largest = max(float(np.abs(record.measured[name]).max()) for record in problem.records)
        if np.abs(run).max() > ratio * largest:
            return True
    return False


def _initial_unknowns(candidate: Hypothesis) -> FloatArray:
    """Return the own unknowns (q,) of a new record, in units: the state at rest, the others as in the first record."""
    return np.append(find_rest_state(candidate), candidate.starts[0, candidate.states :])


def _predict(
    record: FitRecord, candidate: Hypothesis, own: FloatArray, problem: Problem
) -> FloatArray | None:
    """Return the prediction of a record and its sensitivities.

    Args:
        record: The record; only its input is known.
        candidate: A fitted candidate.
        own: Unknowns (q,) of the record alone, in units.
        problem: Gives the integration steps a period.

    Returns:
        Prediction and sensitivities by p shared and q own unknowns (1 + p + q, outputs, n); None where it diverges.
    """
    line = candidate.sensitivity.linearise(record, candidate.shared, own, problem.steps_per_period)
    return None if line is None else np.concatenate((line.residual[None], line.shared, line.local))


def _fit_initial_state(
    true: FloatArray, rival: FloatArray, candidate: Hypothesis, record: FitRecord, problem: Problem,
    whiten: Callable[[FloatArray], FloatArray],
) -> FloatArray:  # fmt: skip
    """Return a rival's whitened prediction from the own unknowns at which it comes nearest to another prediction.

    Args:
        true: Prediction (n,) of the candidate that is taken as true, whitened.
        rival: Prediction and sensitivities (1 + p + q, n) of the rival at rest, whitened.
        candidate: The rival.
        record: The record; only its input is known.
        problem: Gives the integration steps a period, and the thresholds.
        whiten: Whitens a table (k, outputs, n) into rows.

    Returns:
        Prediction and sensitivities (1 + p + q, n), whitened.
    """
    own, shared = _initial_unknowns(candidate), len(candidate.shared)
    for _ in range(problem.thresholds.experiment.initial_state_steps):
        along = rival[1 + shared :]
        if not len(along):
            break
        step = np.linalg.lstsq(along.T, true - rival[0], rcond=1e-9)[0]
        moved_own = own + step * candidate.sensitivity.state_scale
        table = _predict(record, candidate, moved_own, problem)
        moved = whiten(table) if table is not None else None
        if moved is None or np.sum((true - moved[0]) ** 2) >= np.sum((true - rival[0]) ** 2):
            break
        own, rival = moved_own, moved
    return rival


def count_common_samples(predicted: FloatArray, sizes: FloatArray, period: int, most: float) -> int:
    """Return the number of samples up to where predictions take different courses.

    Args:
        predicted: Predictions (candidates + 1, outputs, n); the last is that of the nominal model.
        sizes: RMS (outputs,) of the readings so far; where the predictions' own is larger, it is used instead.
        period: Period of the motion [samples].
        most: RMS difference over one period, as a fraction of the size, from which two predictions are different
            motions.
    """
    apart = np.nan_to_num(predicted, nan=np.inf, posinf=np.inf, neginf=-np.inf)
    with np.errstate(invalid="ignore"):
        spread = np.nan_to_num(apart.max(axis=0) - apart.min(axis=0), nan=np.inf, posinf=np.inf)
    moving = predicted[:-1].std(axis=2).max(axis=0)
    reach = [
        followed_samples(difference, period, most * float(max(size, own)))
        for difference, size, own in zip(spread, sizes, moving, strict=True)
    ]
    return min(reach)


def compute_output_rms(problem: Problem, output: str) -> float:
    """Return the RMS of an output's readings about each record's mean, in its unit."""
    readings = [record.measured[output][record.first :] for record in problem.records]
    count = sum(len(values) for values in readings)
    return float(np.sqrt(sum(len(values) * float(np.var(values)) for values in readings) / count))


def find_rest_state(candidate: Hypothesis) -> FloatArray:
    """Return the state at rest (states,): the model's own start, or where the first record began if it has two wells.

    A temperature is not at rest at zero.
    """
    values = np.array([one.value for one in candidate.simulation.parameters])
    start = candidate.simulation.starting(NOTHING, values)[: candidate.states].copy()
    if has_two_wells(candidate.simulation):
        start[0] = candidate.starts[0][0]
    return start
