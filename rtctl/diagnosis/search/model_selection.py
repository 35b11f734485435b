"""Model selection: rank fitted sets by plain cost while the noise is unknown, then by BIC of whitened residuals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import project, unexplained_residual
from rtctl.diagnosis.residual.projection.residual_rows import residual_rows
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.identification.noise.residual_noise import NoiseModel, fit_noise, group_by_period


class RankedHypothesis(NamedTuple):
    """A fitted set of causes with its rank."""

    hypothesis: Hypothesis
    bic: float
    """Bayesian information criterion, comparable within one ranking."""


def rank_hypotheses(
    problem: Problem, fits: Sequence[Hypothesis], best: TestedHypothesis, *, plain: bool
) -> tuple[RankedHypothesis, ...]:
    """Return the fitted sets with their BIC, lowest first.

    Args:
        problem: Records that were fitted.
        fits: Fitted sets of one size.
        best: The best of them, whose noise whitens all residuals.
        plain: Whether to take residuals as white, each with a variance of its own, since no set passes.
    """
    made = []
    for hypothesis in fits:
        bic = plain_bic(problem, hypothesis) if plain else whitened_bic(problem, hypothesis, best.noise)
        made.append(RankedHypothesis(hypothesis, bic))
    return tuple(sorted(made, key=lambda ranked: ranked.bic))


def whitened_bic(problem: Problem, hypothesis: Hypothesis, noise: Sequence[NoiseModel]) -> float:
    """Return the BIC at the minimum of the whitened residual, one Gauss-Newton step from that of the plain one."""
    rows = residual_rows(problem, hypothesis)
    if rows is None:
        return np.inf
    projected = project(rows, noise)
    return projected.residual + count_unknowns(hypothesis) * float(np.log(projected.samples))


def select_likeliest(problem: Problem, fits: Sequence[Hypothesis]) -> Hypothesis:
    """Return the set of the lowest BIC, each with coloured noise of its own; the first if none can be linearised."""
    scored = []
    for hypothesis in fits:
        rows = residual_rows(problem, hypothesis)
        if rows is not None:
            left = unexplained_residual(rows, [NoiseModel(np.empty(0), 1.0)] * rows[0].residual.shape[0])
            count, likelihood = sum(one.shape[1] for one in left), 0.0
            for alike in group_by_period([row.period_s for row in rows]):
                models = [fit_noise([left[k][o] for k in alike]) for o in range(len(left[0]))]
                deviance = sum(float(np.log(max(one.variance, 1e-300))) for one in models)
                likelihood += sum(left[k].shape[1] for k in alike) * deviance
            scored.append((likelihood + count_unknowns(hypothesis) * float(np.log(count)), hypothesis))
    return min(scored, key=lambda pair: pair[0])[1] if scored else fits[0]


def count_unknowns(hypothesis: Hypothesis) -> int:
    """Return the number of fitted parameters: shared ones and those of each record."""
    return len(hypothesis.shared) + hypothesis.starts.size


def plain_bic(problem: Problem, hypothesis: Hypothesis) -> float:
    """Return the BIC of white residuals."""
    samples = sum(record.samples - record.first for record in problem.records)
    fit = samples * float(np.log(max(hypothesis.cost, 1e-300)))
    return fit + count_unknowns(hypothesis) * float(np.log(samples))


def best_of_each_set(fits: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return the first fit of each set of mechanisms."""
    first: dict[frozenset[str], Hypothesis] = {}
    for fit in fits:
        first.setdefault(frozenset(fit.mechanisms), fit)
    return list(first.values())
