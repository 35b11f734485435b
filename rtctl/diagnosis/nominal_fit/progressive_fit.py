"""Progressive fits: a record on another branch is fitted from its initial part on.

Near a fold one record jumps to another branch, or crosses a barrier at another moment, and no small step of any
parameter leads back. The other records tell the parameters, and its initial part tells its initial state; from there
the fit takes in ever more of the record, so that it never has far to go.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.initial_states import costs_of_states, improve_initial_states
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem


def fit_progressively(problem: Problem, hypothesis: Hypothesis) -> Hypothesis:
    """Return the same set with outlying records fitted progressively, if that lowers the cost; else unchanged."""
    limits = problem.thresholds.nominal_fit
    if not hypothesis.states or len(problem.records) < 2:
        return hypothesis
    for _ in problem.records[: limits.max_progressive_records]:
        outlier = _find_outlier(problem, hypothesis)
        better = _fit_outlier(problem, hypothesis, outlier) if outlier is not None else None
        if better is None or better.cost > (1.0 - limits.progressive_improvement) * hypothesis.cost:
            break
        hypothesis = better
    return hypothesis


def _find_outlier(problem: Problem, hypothesis: Hypothesis) -> int | None:
    """Return the record with the largest residual, if it is clearly larger than the others'."""
    costs = [
        costs_of_states(problem, hypothesis, index, hypothesis.start(index)[None])[0]
        for index in range(len(problem.records))
    ]
    rms = np.sqrt(np.array(costs) / [record.samples - record.first for record in problem.records])
    worst = int(np.argmax(rms))
    usual = np.median(np.delete(rms, worst))
    return worst if rms[worst] > problem.thresholds.nominal_fit.outlier_ratio * usual else None


def _fit_outlier(problem: Problem, hypothesis: Hypothesis, outlier: int) -> Hypothesis | None:
    """Fit with ever more of the record `outlier`; None where not even its initial part can be fitted."""
    limits = problem.thresholds.nominal_fit
    fit = _fit_others(problem, hypothesis, outlier)
    reached, part = 0.0, limits.first_part
    for _ in range(limits.max_progressive_fits):
        if fit is None or reached == 1.0:
            break
        partial = _with_part(problem, outlier, part)
        further = _fit_from(partial, fit, limits.progressive_iterations)
        if further is not None and _find_outlier(partial, further) != outlier:
            fit, reached, part = further, part, min(1.0, 2.0 * part)
            continue
        if not reached or part - reached <= limits.min_part_step:
            break
        part = 0.5 * (reached + part)
    if fit is None or not reached:
        return None
    return fit_hypothesis(
        problem, fit.simulation, fit.mechanisms, fit.starts, fixed_parameters=fit.fixed_parameters
    )


def _with_part(problem: Problem, outlier: int, part: float) -> Problem:
    """Return the problem with an initial part [fraction of what is scored] of one record."""
    records = tuple(
        record.truncate(record.first + max(1, round(part * (record.samples - record.first))))
        if k == outlier
        else record
        for k, record in enumerate(problem.records)
    )
    return replace(problem, records=records)


def _fit_others(problem: Problem, hypothesis: Hypothesis, outlier: int) -> Hypothesis | None:
    """Fit the other records, and keep the initial state of `outlier`."""
    kept = [k for k in range(len(problem.records)) if k != outlier]
    others = replace(problem, records=tuple(problem.records[k] for k in kept))
    fit = fit_hypothesis(
        others,
        hypothesis.simulation,
        hypothesis.mechanisms,
        hypothesis.starts[kept],
        fixed_parameters=hypothesis.fixed_parameters,
    )
    if fit is None:
        return None
    starts = hypothesis.starts.copy()
    starts[kept] = fit.starts
    return replace(fit, starts=starts)


def _fit_from(problem: Problem, fit: Hypothesis, iterations: int) -> Hypothesis | None:
    """Fit from the parameters of `fit`, and its initial states or better ones."""
    there = fit_hypothesis(problem, fit.simulation, fit.mechanisms, fit.starts, 0, fit.fixed_parameters)
    if there is None:
        return None
    there = improve_initial_states(problem, there)
    return fit_hypothesis(
        problem, there.simulation, there.mechanisms, there.starts, iterations, there.fixed_parameters
    )
