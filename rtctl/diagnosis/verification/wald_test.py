"""A value that is off while the structure is right: `parameter.<name>`.

Asked where the re-fitted nominal model is adequate and the model of the file is not. With d what the re-fit changed and
C its covariance, all others than one being right is tested by d' C^-1 d over the others (Wald's statistic), which
does not ask how far off the one is. A file whose values are all somewhat off was a start for a fit, and claims nothing.
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
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests

MATERIAL = 0.1
"""Of the noise: RMS of what the file's values leave beyond it, below which nobody need care."""
APART = 5.0
"""Times as far off, relative to its value, as any other could be: else all of them are off."""
NORMAL_95 = 1.96
OTHERS_RIGHT = 1e-3
"""How often the others of a file with one wrong value may be taken for wrong too: it costs the claim, not a false one.
"""


class WrongValue(NamedTuple):
    """One parameter of the file's model whose value the data refute, the others being right."""

    name: str
    given: TestedHypothesis
    """The file's model."""
    revised: TestedHypothesis
    """With this one fitted, all others as the file has them."""
    probability: float
    """Of this one, of all that are one alone."""
    share_removed: float
    """Of the squares beyond the noise that the file's model leaves."""
    equivalent: tuple[str, ...]
    """Parameters that could be off in its place."""


def wrong_value(
    problem: Problem, given: Simulation, spreads: Mapping[str, float], nominal: TestedHypothesis, rate: float
) -> WrongValue | None:
    """The one that is off, if it is one; None: the file's values are right, or more than one is wrong.

    `given`: the model of the file, `spreads`: standard errors over its values, where the file says them; `nominal`: the
    same re-fitted and adequate; `rate` of false claims.
    """
    hypothesis, sensitivity = nominal.hypothesis, nominal.hypothesis.sensitivity
    free = sensitivity.free
    if len(free) == 0 or problem.subject.allowed_share:
        return None
    believed = np.array([given.parameters[k].value for k in free]) / sensitivity.scale
    found = hypothesis.shared - nominal.projected.shift  # the optimum in the metric of the noise
    spread = np.abs(believed) * [spreads.get(given.parameters[k].name, 0.0) for k in free]
    off, covariance = found - believed, nominal.projected.covariance + np.diag(spread**2)
    alone = [
        statistic(np.delete(off, k), np.delete(np.delete(covariance, k, 0), k, 1)) for k in range(len(free))
    ]
    all_right = statistic(off, covariance)
    material = MATERIAL**2 * nominal.projected.samples
    if chi2.sf(all_right, len(off)) > rate / 10.0 or all_right < material:
        return None
    others = len(off) - 1
    passing = [
        k for k in np.argsort(alone)
        if (not others or chi2.sf(alone[k], others) > OTHERS_RIGHT) and _stands_out(k, off, believed, covariance)
    ]  # fmt: skip
    if not passing:
        return None
    first = int(passing[0])
    revised = _revised(problem, given, nominal, first)
    if revised is None:
        return None
    weights = np.exp(-0.5 * (np.array(alone)[passing] - alone[first]))
    names = [given.parameters[free[k]].name for k in passing]
    cost = hypothesis.cost * (1.0 + all_right / max(nominal.projected.residual, 1e-300))
    as_given = nominal._replace(hypothesis=replace(hypothesis, simulation=given, shared=believed, cost=cost))
    return WrongValue(
        name=names[0], given=as_given, revised=revised, probability=float(weights[0] / weights.sum()),
        share_removed=float(np.clip(1.0 - alone[first] / all_right, 0.0, 1.0)), equivalent=tuple(names[1:]),
    )  # fmt: skip


def statistic(off: FloatArray, covariance: FloatArray) -> float:
    """Wald's, chi-squared of len(off) degrees of freedom where the believed values are right."""
    if len(off) == 0:
        return 0.0
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    normal = covariance / np.outer(size, size)
    return float((off / size) @ np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ (off / size))


def _stands_out(k: int, off: FloatArray, believed: FloatArray, covariance: FloatArray) -> bool:
    """Whether it is off by far more, relative to its value, than any other that has one can be."""
    size = np.abs(believed)
    if not size[k] > 0.0:
        return True
    could = np.abs(off) + NORMAL_95 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    others = [could[j] / size[j] for j in range(len(off)) if j != k and size[j] > 0.0]
    return bool(abs(off[k]) / size[k] > APART * max(others, default=0.0))


def _revised(
    problem: Problem, given: Simulation, nominal: TestedHypothesis, position: int
) -> TestedHypothesis | None:
    hypothesis, free = nominal.hypothesis, nominal.hypothesis.sensitivity.free
    values = np.array([parameter.value for parameter in given.parameters])
    values[free[position]] = hypothesis.values[free[position]]
    others = frozenset(given.parameters[k].name for j, k in enumerate(free) if j != position)
    again = fit_hypothesis(
        problem,
        given.with_values(values),
        hypothesis.mechanisms,
        hypothesis.starts,
        still=hypothesis.still | others,
    )
    return None if again is None else run_residual_tests(again, problem, (), nominal.noise)
