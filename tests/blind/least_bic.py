"""Baseline: the set of lowest BIC is named, whatever is left of the residual. No gate, no "none of these".

It is offered what the search fitted (nothing, singles, pairs, triples) and, beyond the set that the search ended at,
each further mechanism by its score there, which for an effect as small as one that passed the gate is its fit. Each
set's BIC is of its own coloured noise, n log(variance) + unknowns log(n).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import group_by_shapes
from rtctl.diagnosis.residual.projection import unexplained_residual
from rtctl.diagnosis.residual.projection.residual_rows import residual_rows
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.model_selection import count_unknowns
from rtctl.identification.noise.residual_noise import NoiseModel, fit_noise

OF_A_SIZE = 3
"""Best sets of each size that are weighed again: the others are far off."""


def least_bic(found: Diagnosis) -> dict[str, Any]:
    """`verdict` and `causes` as a judged line has them."""
    search, data = found.search, found.problem
    fitted = [search.nominal.hypothesis, search.chosen.hypothesis]
    for ranking in search.rankings:
        fitted += [one.hypothesis for one in sorted(ranking, key=lambda one: one.hypothesis.cost)[:OF_A_SIZE]]
    weighed = [(bic(data, one), one.mechanisms) for one in _each_once(fitted)]
    if search.chosen.hypothesis.mechanisms == min(weighed)[1]:
        weighed += [
            (min(weighed)[0] + change, (*search.chosen.hypothesis.mechanisms, identity))
            for identity, change in further_ones(search.chosen)
        ]
    names = min(weighed)[1]
    already = search.nominal.hypothesis.mechanisms
    causes = [{"id": name, "or": []} for name in names if name not in already]
    return {"verdict": "explained" if causes else "adequate", "causes": causes}


def _each_once(fitted: list[Hypothesis]) -> list[Hypothesis]:
    return list({frozenset(one.mechanisms): one for one in reversed(fitted)}.values())


def bic(data: Problem, hypothesis: Hypothesis) -> float:
    """Of one fitted set, its residual whitened by an autoregression of its own; infinite on the edge of divergence."""
    rows = residual_rows(data, hypothesis)
    if rows is None:
        return np.inf
    left = unexplained_residual(rows, [NoiseModel(np.empty(0), 1.0)] * rows[0].residual.shape[0])
    noise = [fit_noise([one[o] for one in left]) for o in range(len(left[0]))]
    count = sum(one.shape[1] for one in left)
    likelihood = count * sum(float(np.log(max(one.variance, 1e-300))) for one in noise)
    return likelihood + count_unknowns(hypothesis) * float(np.log(count))


def further_ones(at: TestedHypothesis) -> list[tuple[str, float]]:
    """Change of BIC by each further mechanism, from its score: minus what it removes, plus its unknowns' price."""
    named = [k for k, direction in enumerate(at.directions) if direction.mechanism]
    changes: dict[str, float] = {}
    for members in group_by_shapes(at.directions, named):
        identity, shapes = at.directions[members[0]].mechanism, at.directions[members[0]].shapes
        removed, rank = at.projected.block(np.array(members))
        change = (rank + len(shapes)) * float(np.log(at.projected.samples)) - removed if rank else np.inf
        changes[identity] = min(changes.get(identity, np.inf), change)
    return list(changes.items())
