"""From the nominal model to sets of causes: screen by projected scores, refit, rank, and let the gate decide.

One effect, else two, else three. A larger set is looked for only where no smaller one passes the gate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.diagnosis.directions import Direction
from rtctl.diagnosis.gate import Examined, examine, start_of
from rtctl.diagnosis.hypothesis import Data, Hypothesis, fitted
from rtctl.diagnosis.projection import Projected

FloatArray = NDArray[np.float64]
LARGEST_SET = 3
BEAM = 3
"""Best sets of one size that are extended to the next."""
SHAPES_TRIED = 2
START_FACTORS = (1.0, 0.3)
EQUIVALENT = 10.0
"""Difference of BIC below which data do not decide between two sets."""
WEAK = 0.02
"""Mechanisms whose score is below this share of the best one are fitted from one start only."""


class Ranked(NamedTuple):
    """A set of causes with its fit: `bic` in the whitened residual of the best of its size."""

    hypothesis: Hypothesis
    bic: float
    examined: Examined | None


class Search(NamedTuple):
    """What came of it."""

    nominal: Examined
    chosen: Examined
    """The smallest set that passes, else the best of the largest size."""
    passes: bool
    equivalent: tuple[Hypothesis, ...]
    """Others of its size that these data explain as well."""
    tried: tuple[tuple[Ranked, ...], ...]
    """By size, best first."""


def search(
    data: Data,
    nominal: Hypothesis,
    ids: Sequence[str],
    false_claim_rate: float,
    told: Callable[[str], None] = lambda text: None,
) -> Search:
    """The causes of what `nominal`, fitted, gets wrong."""
    at_nominal = examine(nominal, data, ids)
    if at_nominal.p_value > false_claim_rate:
        return Search(at_nominal, at_nominal, True, (), ())
    parents, tried = [at_nominal], []
    best = at_nominal
    for size in range(1, LARGEST_SET + 1):
        found = _extend(data, parents, told)
        if not found:
            break
        best = examine(min(found, key=lambda one: one.cost), data, ids)
        ranking = _rank(data, found, best)
        tried.append(ranking)
        if best.p_value > false_claim_rate:
            return Search(
                at_nominal, best, True, _equivalent(data, ranking, best, ids, false_claim_rate), tuple(tried)
            )
        parents = [examine(one.hypothesis, data, ids) for one in ranking[:BEAM]] if size < LARGEST_SET else []
        told(f"{size} causes do not explain it")
    return Search(at_nominal, best, False, (), tuple(tried))


def _extend(data: Data, parents: Sequence[Examined], told: Callable[[str], None]) -> list[Hypothesis]:
    """Each parent with each further mechanism, fitted; each set once, its best fit."""
    found: dict[frozenset[str], Hypothesis] = {}
    for parent in parents:
        for identity, strength in _screened(parent):
            key = frozenset((*parent.hypothesis.mechanisms, identity))
            told(" + ".join(sorted(key)))
            child = _with(data, parent, identity, one_start=strength < WEAK)
            if child is not None and (key not in found or child.cost < found[key].cost):
                found[key] = child
    return list(found.values())


def _screened(parent: Examined) -> list[tuple[str, float]]:
    """Mechanisms that the residual has any room for, with their score as a share of the best, best first."""
    by_id: dict[str, list[int]] = {}
    for k, direction in enumerate(parent.directions):
        if direction.mechanism:
            by_id.setdefault(direction.mechanism, []).append(k)
    scores = {
        identity: max(
            parent.projected.block(np.array(group))[0] for group in _by_shape(parent.directions, indices)
        )
        for identity, indices in by_id.items()
    }
    top = max(scores.values(), default=0.0) or 1.0
    ranking = sorted(((identity, score / top) for identity, score in scores.items()), key=lambda one: -one[1])
    limit = len(ranking) if not parent.hypothesis.mechanisms else 8
    return ranking[:limit]


def _by_shape(directions: Sequence[Direction], indices: Sequence[int]) -> list[list[int]]:
    groups: dict[tuple[tuple[str, float], ...], list[int]] = {}
    for k in indices:
        groups.setdefault(tuple(directions[k].shapes.items()), []).append(k)
    return list(groups.values())


def _with(data: Data, parent: Examined, identity: str, *, one_start: bool) -> Hypothesis | None:
    """The parent's set with one more mechanism, from the linear estimate of its size, in its best shapes."""
    mine = [k for k, direction in enumerate(parent.directions) if direction.mechanism == identity]
    groups = sorted(_by_shape(parent.directions, mine), key=lambda g: -parent.projected.block(np.array(g))[0])
    best: Hypothesis | None = None
    for group in groups[: 1 if one_start else SHAPES_TRIED]:
        for factor in START_FACTORS[:1] if one_start else START_FACTORS:
            child = _from_start(data, parent, identity, group, factor)
            if child is not None and (best is None or child.cost < best.cost):
                best = child
    return best


def _from_start(
    data: Data, parent: Examined, identity: str, group: Sequence[int], factor: float
) -> Hypothesis | None:
    hypothesis = parent.hypothesis
    simulation = hypothesis.simulation.extended((identity,))
    at = {p.declared.name: k for k, p in enumerate(simulation.parameters) if p.mechanism == identity}
    steps = _joint_step(parent.projected, len(hypothesis.shared), group)
    for _ in range(4):
        values = np.array([parameter.value for parameter in simulation.parameters])
        for k, step in zip(group, steps, strict=True):
            direction = parent.directions[k]
            for name, value in direction.shapes.items():
                values[at[name]] = value
            values[at[direction.name]] += factor * step * direction.scale
        child = fitted(
            data, start_of(simulation, values), (*hypothesis.mechanisms, identity), hypothesis.starts
        )
        if child is not None:
            return child
        factor *= 0.1
    return None


def _joint_step(projected: Projected, shared: int, group: Sequence[int]) -> FloatArray:
    """Least-squares steps along directions that act together."""
    index = 1 + np.asarray(group)
    matrix = projected.left[np.ix_(index, index)]
    right = -projected.left[index, 0]
    solved = np.linalg.lstsq(matrix + 1e-9 * np.eye(len(index)), right, rcond=1e-9)[0]
    steps: FloatArray = solved * projected.scale[0] / projected.scale[shared + index]
    return steps


def _rank(data: Data, found: Sequence[Hypothesis], best: Examined) -> tuple[Ranked, ...]:
    """By BIC of the residuals, whitened by the noise of the best: one measure for all."""
    ranking = []
    for hypothesis in found:
        squares, samples = 0.0, 0
        try:
            lines = hypothesis.linearise(data)
        except ArithmeticError:
            continue
        for line in lines:
            white = np.stack([model.whiten(line.residual[o]) for o, model in enumerate(best.noise)])
            squares += float(np.sum(white**2))
            samples += white.size
        bic = squares + len(hypothesis.shared) * np.log(samples)
        ranking.append(Ranked(hypothesis, bic, best if hypothesis is best.hypothesis else None))
    return tuple(sorted(ranking, key=lambda one: one.bic))


def _equivalent(
    data: Data, ranking: Sequence[Ranked], best: Examined, ids: Sequence[str], rate: float
) -> tuple[Hypothesis, ...]:
    """Sets of the same size that the data do not tell from the best."""
    reference = next((one.bic for one in ranking if one.hypothesis is best.hypothesis), ranking[0].bic)
    close = [
        one for one in ranking if one.hypothesis is not best.hypothesis and one.bic < reference + EQUIVALENT
    ]
    return tuple(
        one.hypothesis for one in close if examine(one.hypothesis, data, ids, best.noise).p_value > rate
    )
