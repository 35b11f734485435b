"""Wald's test of single values of the model file: `parameter.<name>`, a wrong value in a right structure.

It is run where the re-fitted nominal model is adequate and the model of the file is not. With d the change by the
re-fit and C its covariance, the hypothesis that all values but one are right is tested by d' C^-1 d over the others,
whatever the deviation of the one. A file whose values are all somewhat off was a start for a fit: nothing is claimed.
A. Wald, Trans. Am. Math. Soc. 54 (1943) 426.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.border.statistics import NORMAL_95
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.thresholds import VerificationThresholds


class WrongValue(NamedTuple):
    """One parameter of the model file whose value the data refute, while the others are right."""

    name: str
    given: TestedHypothesis
    """The model of the file."""
    revised: TestedHypothesis
    """The same with this parameter fitted, and all others as the file has them."""
    probability: float
    """Probability of this parameter, among all that could be the only wrong one."""
    share_removed: float
    """Fraction of the squares beyond the noise, left by the model of the file, that the revised value removes."""
    equivalent: tuple[str, ...]
    """Parameters that could be wrong in its place."""


class _Deviations(NamedTuple):
    """Deviations of the fitted values from those of the file, scaled as the fit's unknowns."""

    believed: FloatArray
    """(p,) values of the file."""
    change: FloatArray
    """(p,) optimum in the metric of the noise, less the file's values."""
    covariance: FloatArray
    """(p, p) of `change`, with the uncertainty of the file's values."""

    @property
    def total(self) -> float:
        """Return Wald's statistic of all values together."""
        return wald_statistic(self.change, self.covariance)

    def of_others(self, k: int) -> float:
        """Return Wald's statistic of all values but the one at `k`."""
        others = np.delete(np.delete(self.covariance, k, 0), k, 1)
        return wald_statistic(np.delete(self.change, k), others)


def find_wrong_value(
    problem: Problem, given: Simulation, spreads: Mapping[str, float], nominal: TestedHypothesis, rate: float
) -> WrongValue | None:
    """Find the one value of the model file that is wrong, if it is one.

    Args:
        problem: Records that were fitted.
        given: The model of the file.
        spreads: Standard errors over values, by name, where the file has them.
        nominal: The same model, re-fitted and adequate.
        rate: Rate of false claims.

    Returns:
        None where the file's values are right, or more than one is wrong.
    """
    hypothesis, limits = nominal.hypothesis, problem.thresholds.verification
    free = hypothesis.sensitivity.free
    if len(free) == 0 or problem.subject.allowed_share:
        return None
    deviations = _deviations_of(given, spreads, nominal)
    total = deviations.total
    level, material = limits.lone_value_level_share * rate, limits.material_rms**2
    if chi2.sf(total, len(free)) > level or total < material * nominal.projected.samples:
        return None
    remaining = np.array([deviations.of_others(k) for k in range(len(free))])
    candidates = _lone_candidates(deviations, remaining, limits)
    if not candidates:
        return None
    first = candidates[0]
    revised = _revise_value(problem, given, nominal, first)
    if revised is None:
        return None
    weights = np.exp(-0.5 * (remaining[candidates] - remaining[first]))
    names = [given.parameters[free[k]].name for k in candidates]
    cost = hypothesis.cost * (1.0 + total / max(nominal.projected.residual, 1e-300))
    as_given = replace(hypothesis, simulation=given, shared=deviations.believed, cost=cost)
    return WrongValue(
        name=names[0],
        given=nominal._replace(hypothesis=as_given),
        revised=revised,
        probability=float(weights[0] / weights.sum()),
        share_removed=float(np.clip(1.0 - remaining[first] / total, 0.0, 1.0)),
        equivalent=tuple(names[1:]),
    )


def _deviations_of(given: Simulation, spreads: Mapping[str, float], nominal: TestedHypothesis) -> _Deviations:
    """Return how far the re-fit is from the values of the file, and how certain that is."""
    sensitivity = nominal.hypothesis.sensitivity
    free = sensitivity.free
    believed = np.array([given.parameters[k].value for k in free]) / sensitivity.scale
    optimum = nominal.hypothesis.shared - nominal.projected.shift
    spread = np.abs(believed) * [spreads.get(given.parameters[k].name, 0.0) for k in free]
    return _Deviations(believed, optimum - believed, nominal.projected.covariance + np.diag(spread**2))


def _lone_candidates(
    deviations: _Deviations, remaining: FloatArray, limits: VerificationThresholds
) -> list[int]:
    """Return the positions of values that may be the only wrong one, the likeliest first."""
    others = len(remaining) - 1
    return [
        int(k)
        for k in np.argsort(remaining)
        if (not others or chi2.sf(remaining[k], others) > limits.others_right_p)
        and _stands_out(int(k), deviations, limits.lone_deviation_ratio)
    ]


def wald_statistic(change: FloatArray, covariance: FloatArray) -> float:
    """Return Wald's statistic: chi-squared of len(change) degrees of freedom where the believed values are right."""
    if len(change) == 0:
        return 0.0
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    normal = covariance / np.outer(size, size)
    return float((change / size) @ np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ (change / size))


def _stands_out(k: int, deviations: _Deviations, ratio: float) -> bool:
    """Return whether a value deviates, relative to its size, by `ratio` times what any other value can."""
    size = np.abs(deviations.believed)
    if not size[k] > 0.0:
        return True
    change = np.abs(deviations.change)
    largest = change + NORMAL_95 * np.sqrt(np.maximum(np.diag(deviations.covariance), 0.0))
    others = [largest[j] / size[j] for j in range(len(size)) if j != k and size[j] > 0.0]
    return bool(change[k] / size[k] > ratio * max(others, default=0.0))


def _revise_value(
    problem: Problem, given: Simulation, nominal: TestedHypothesis, position: int
) -> TestedHypothesis | None:
    """Fit one value of the file, all others as they are; None where that diverges."""
    hypothesis, free = nominal.hypothesis, nominal.hypothesis.sensitivity.free
    values = np.array([parameter.value for parameter in given.parameters])
    values[free[position]] = hypothesis.values[free[position]]
    others = frozenset(given.parameters[k].name for j, k in enumerate(free) if j != position)
    refitted = fit_hypothesis(
        problem,
        given.with_values(values),
        hypothesis.mechanisms,
        hypothesis.starts,
        fixed_parameters=hypothesis.fixed_parameters | others,
    )
    return None if refitted is None else run_residual_tests(refitted, problem, (), nominal.noise)
