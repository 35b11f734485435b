"""Which of several fitted sets is best: by plain cost while the noise is unknown, then by BIC of whitened residuals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import leftover, project
from rtctl.diagnosis.residual.residual_rows import own_rows
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.identification.noise.residual_noise import NoiseModel, fit_noise, group_by_period


class RankedHypothesis(NamedTuple):
    """A set of causes with its fit: `bic` in the whitened residual of the best of its size."""

    hypothesis: Hypothesis
    bic: float


def rank_hypotheses(
    problem: Problem, field: Sequence[Hypothesis], best: TestedHypothesis, *, plain: bool
) -> tuple[RankedHypothesis, ...]:
    """Lowest BIC first; `plain`: of white residuals, each with a variance of its own."""
    made = []
    for hypothesis in field:
        bic = plain_bic(problem, hypothesis) if plain else whitened_bic(problem, hypothesis, best.noise)
        made.append(RankedHypothesis(hypothesis, bic))
    return tuple(sorted(made, key=lambda one: one.bic))


def whitened_bic(problem: Problem, hypothesis: Hypothesis, noise: Sequence[NoiseModel]) -> float:
    """Of one set, at the optimum of its whitened residual: one Gauss-Newton step from the plain one."""
    rows = own_rows(problem, hypothesis)
    if rows is None:
        return np.inf
    projected = project(rows, noise)
    return projected.residual + unknowns(hypothesis) * float(np.log(projected.samples))


def select_likeliest(problem: Problem, field: Sequence[Hypothesis]) -> Hypothesis:
    """The likeliest, each with coloured noise of its own."""
    found = []
    for hypothesis in field:
        rows = own_rows(problem, hypothesis)
        if rows is not None:
            left = leftover(rows, [NoiseModel(np.empty(0), 1.0)] * rows[0].residual.shape[0])
            count, likelihood = sum(one.shape[1] for one in left), 0.0
            for own in group_by_period([row.period_s for row in rows]):
                models = [fit_noise([left[k][o] for k in own]) for o in range(len(left[0]))]
                deviance = sum(float(np.log(max(one.variance, 1e-300))) for one in models)
                likelihood += sum(left[k].shape[1] for k in own) * deviance
            found.append((likelihood + unknowns(hypothesis) * float(np.log(count)), hypothesis))
    return min(found, key=lambda one: one[0])[1] if found else field[0]


def unknowns(hypothesis: Hypothesis) -> int:
    """Shared ones and those of each record."""
    return len(hypothesis.shared) + hypothesis.starts.size


def plain_bic(problem: Problem, hypothesis: Hypothesis) -> float:
    """Of white residuals."""
    samples = sum(record.samples - record.first for record in problem.records)
    fit = samples * float(np.log(max(hypothesis.cost, 1e-300)))
    return fit + unknowns(hypothesis) * float(np.log(samples))
