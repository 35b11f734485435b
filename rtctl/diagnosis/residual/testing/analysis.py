"""The residual of a fitted hypothesis beside all directions in which it may be wrong, ready to be tested."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import (
    Direction,
    catalogue_directions,
    force_directions,
    mechanism_sensitivities,
)
from rtctl.diagnosis.residual.projection import Projected, RecordRows, estimate_noise, project
from rtctl.diagnosis.residual.projection.residual_rows import account_for_quantization
from rtctl.diagnosis.residual.testing.lags import lagged_series, memory_directions
from rtctl.identification.noise.residual_noise import NoiseModel
from rtctl.identification.simulation_error.sensitivity import Linearisation
from rtctl.identification.threads import each


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualAnalysis:
    """A residual in units of its noise, beside the directions that may explain it."""

    hypothesis: Hypothesis
    """Hypothesis at its optimum."""
    problem: Problem
    """Problem with the records that are tested."""
    directions: tuple[Direction, ...]
    """Directions (k) of the catalogue, of generic forces, and of the past of motion and drive."""
    rows: tuple[RecordRows, ...]
    """Residual, sensitivities and directions of each record."""
    noise: tuple[NoiseModel, ...]
    """Noise model of each output."""
    projected: Projected
    """Residual and directions beyond the fitted parameters, in units of the noise."""

    @property
    def is_quantized(self) -> bool:
        """Whether a reading shows a converter's steps: its error follows the motion, and repeats."""
        return any(self.problem.step(name) > 0.0 for name in self.hypothesis.sensitivity.outputs)


def analyse_residual(
    hypothesis: Hypothesis, problem: Problem, ids: Sequence[str], noise: Sequence[NoiseModel] | None = None
) -> ResidualAnalysis:
    """Prepare the residual of a hypothesis for its tests.

    Args:
        hypothesis: Fitted hypothesis, at its optimum.
        problem: Problem that it was fitted to.
        ids: Ids of the catalogue's mechanisms; those that the hypothesis has are left out.
        noise: Noise model of each output, from a better hypothesis; None: estimated from this residual.

    Raises:
        ArithmeticError: if the optimum is at the edge of divergence.
    """
    problem = problem.glance
    others = tuple(identity for identity in ids if identity not in hypothesis.mechanisms)
    linearised = hypothesis.linearise(problem)
    residuals = [record.residual for record in linearised]
    named = catalogue_directions(hypothesis.simulation, others, problem, residuals)
    directions = [*named, *force_directions(problem)]
    near = _guided_by_model(problem, hypothesis, residuals)
    tells_nothing = problem.subject.tells_nothing
    slopes = _named_slopes(hypothesis, near, named)
    for k, of_record in enumerate(slopes):
        of_record.append(problem.subject.force_sensitivities(hypothesis, near, k))
    rows = [_rows_of(hypothesis, problem, slopes[k], k, record) for k, record in enumerate(linearised)]
    if tells_nothing is not None:
        rows = [one.without(tells_nothing(hypothesis, near, k)) for k, one in enumerate(rows)]
    directions += memory_directions(len(rows[0].directions) - len(directions))
    thresholds = problem.thresholds.residual
    if noise is None:
        resonances = problem.subject.resonances(hypothesis.simulation)
        noise = estimate_noise(
            rows,
            resonances=resonances,
            slow=not problem.allowed,
            starts_white=problem.subject.noise_starts_white,
            thresholds=thresholds,
            executor=problem.executor,
        )
    return ResidualAnalysis(
        hypothesis=hypothesis,
        problem=problem,
        directions=tuple(directions),
        rows=tuple(rows),
        noise=tuple(noise),
        projected=project(rows, noise, thresholds),
    )


def _guided_by_model(problem: Problem, hypothesis: Hypothesis, residuals: Sequence[FloatArray]) -> Problem:
    """Return the problem with what the hypothesis predicts in the place of what was measured, where that is a guide.

    A slope is one of the branch on which the hypothesis is, also where another one would be nearer to the data.
    """
    records = []
    for index, record in enumerate(problem.records):
        if record.stimulus.guide and record.first == 0:
            predicted = residuals[index] + _measured(problem, hypothesis, index)
            guide = dict(zip(hypothesis.sensitivity.outputs, predicted, strict=True))
            record = replace(record, stimulus=replace(record.stimulus, guide=guide))
        records.append(record)
    return replace(problem, records=tuple(records))


def _named_slopes(
    hypothesis: Hypothesis, problem: Problem, named: Sequence[Direction]
) -> list[list[FloatArray]]:
    """Return the derivatives (directions, outputs, n) along each form of a mechanism, by record; run in parallel."""
    forms = [list(of) for _, of in groupby(named, key=lambda one: (one.mechanism, one.form))]

    def along(which: tuple[int, int]) -> FloatArray:
        return mechanism_sensitivities(hypothesis, forms[which[1]], problem, which[0])

    every = [(index, form) for index in range(len(problem.records)) for form in range(len(forms))]
    made = each(problem.executor, along, every)
    return [made[k * len(forms) : (k + 1) * len(forms)] for k in range(len(problem.records))]


def _rows_of(
    hypothesis: Hypothesis, problem: Problem, slopes: list[FloatArray], index: int, record: Linearisation
) -> RecordRows:
    """Return the rows of one record with all directions, `slopes` those along the catalogue and generic forces."""
    slopes = [*slopes]
    slopes.append(lagged_series(record.residual + _measured(problem, hypothesis, index), problem, index))
    rows = RecordRows(
        residual=fine_step_residual(hypothesis, problem, index, record.residual),
        shared=record.shared,
        local=record.local,
        directions=np.concatenate(slopes),
        period_s=problem.records[index].period_s,
    )
    return account_for_quantization(rows, problem, index, hypothesis.sensitivity.outputs)


def fine_step_residual(
    hypothesis: Hypothesis, problem: Problem, index: int, coarse: FloatArray
) -> FloatArray:
    """Return the residual at the simulation's own integration steps.

    The error of a fit's coarser steps cancels in a sensitivity; in a residual it does not.

    Args:
        hypothesis: Fitted hypothesis.
        problem: Problem that it was fitted to.
        index: Index of the record.
        coarse: Residual (outputs, n) at the fit's steps, in the outputs' units.

    Returns:
        The residual (outputs, n); `coarse` where the difference is beyond the first order that the sensitivities
        follow to the new optimum.
    """
    record, sensitivity = problem.records[index], hypothesis.sensitivity
    start = np.atleast_2d(hypothesis.start(index))
    run = hypothesis.simulation.predict(record.stimulus, hypothesis.values_of(index), start)
    fine = np.stack([run.outputs[name][0, record.first :] for name in sensitivity.outputs])
    fine = fine - _measured(problem, hypothesis, index)
    most = problem.thresholds.residual.most_fine_step_share
    is_small = np.sum((fine - coarse) ** 2) < most**2 * np.sum(coarse**2)
    return fine if is_small else coarse


def _measured(problem: Problem, hypothesis: Hypothesis, index: int) -> FloatArray:
    record = problem.records[index]
    return np.stack([record.measured[name][record.first :] for name in hypothesis.sensitivity.outputs])
