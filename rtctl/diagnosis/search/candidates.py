"""Where the fits of a set with more mechanisms start: from the linear estimate of their sizes, in their best shapes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations, product

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import FreeParameter
from rtctl.diagnosis.problem.fit import defaulted
from rtctl.diagnosis.residual.directions import ALL, acting_together, parameters_of
from rtctl.diagnosis.residual.projection import Projected
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, start_of
from rtctl.diagnosis.search.successive_halving import Candidate

GROWN = 2
"""Largest set that is extended by all that may act beside it; larger ones grow alone, by the most likely causes."""
MOST_CHILDREN = (9, 6)
"""Mechanisms that a set which has some is extended by: up to `GROWN`, and beyond."""
SHAPES_TRIED = 2
FREQUENCIES_TRIED = 3
"""Shapes, where one of them is a frequency: there are as many valleys as the residual's spectrum has peaks."""
START_FACTORS = (1.0, 0.3)
COLLINEAR = 0.1
"""Squared share of a direction beyond the set's own parameters: below it, they have to make room for it at once, or the
start lies far from the valley."""
WEAK = 0.05
"""Mechanisms whose score is below this share of the best one are fitted from one start only."""
MOST_PAIRS = 8
"""That are begun at once."""
AT_ONCE = 0.3
"""Of the linear step, of two at once: the whole one leaves the valley more often than it comes further along it."""
FURTHEST = 0.5
"""Of its value, or of its typical size if that is more: what one of a set's own parameters makes room by at most."""


def propose_candidates(parent: TestedHypothesis, least: float = 0.0) -> list[Candidate]:
    """The parent's set with each further mechanism, from the linear estimate of its size, in its best shapes.

    Those with a score of `least` times the best one's or more.
    """
    made = []
    large = len(parent.hypothesis.mechanisms) >= GROWN
    for identity, strength in _screened(parent):
        if strength < least:
            continue
        mine = [k for k, direction in enumerate(parent.directions) if direction.mechanism == identity]
        groups = sorted(acting_together(parent.directions, mine), key=lambda group: -_score(parent, group))
        few = strength < WEAK or large
        for form in dict.fromkeys(parent.directions[group[0]].form for group in groups):
            own = [group for group in groups if parent.directions[group[0]].form == form]
            for group in own[:1] if few else _tried(parent, own):
                for factor in START_FACTORS[: 1 if few else len(START_FACTORS)]:
                    made.append(_runner(parent, group, factor))
    return made


def interleave(groups: Sequence[Sequence[Candidate]]) -> list[Candidate]:
    """All of several parents' runners: of each set the first one, the best sets of every parent before any second best,
    then further ones. Where time runs out, no set goes without a fit for another's second start.
    """
    order = []
    for group in groups:
        place: dict[tuple[tuple[str, ...], str], int] = {}
        again = Counter[tuple[tuple[str, ...], str]]()
        for runner in group:
            key = (runner.mechanisms, runner.form)
            rank = place.setdefault(key, len(place))
            order.append((again[key], rank, runner))
            again[key] += 1
    return [runner for _, _, runner in sorted(order, key=lambda one: one[:2])]


def propose_pairs(parent: TestedHypothesis) -> list[Candidate]:
    """The parent's set with two further mechanisms at once: of all pairs those that promise most together.

    One effect alone bends the nominal parameters until the other, beside it, is far from where it would be right, and
    what of the two is no neighbour of the best single cause would never be tried.
    """
    best = []
    for one, other in combinations(_forms(parent).values(), 2):
        groups = ([*first, *second] for first, second in product(one, other))
        best.append(max(((_score(parent, group), group) for group in groups), key=lambda scored: scored[0]))
    best.sort(key=lambda scored: -scored[0])
    return [_runner(parent, group, AT_ONCE) for _, group in best[:MOST_PAIRS]]


def _tried(parent: TestedHypothesis, groups: Sequence[list[int]]) -> Sequence[list[int]]:
    """Of one form's choices of shapes, best first, those that a fit begins with.

    Frequencies have valleys that are apart: no fit goes on to the next one from a step that ends at once, at a bound.
    """
    identity = parent.directions[groups[0][0]].mechanism
    known = parameters_of(parent.hypothesis.simulation.extended((identity,)), identity)
    if not any(one.declared.is_shape and one.unit == "Hz" for one in known.values()):
        return groups[:SHAPES_TRIED]
    return ([group for group in groups if _feasible(parent, group, known)] or groups)[:FREQUENCIES_TRIED]


def _feasible(parent: TestedHypothesis, group: Sequence[int], known: Mapping[str, FreeParameter]) -> bool:
    """Whether the linear step stays within bounds: a mass that would have to be negative is no start."""
    steps = _joint_step(parent.projected, len(parent.hypothesis.shared), group)
    reached = [
        (known[parent.directions[k].name], step * parent.directions[k].scale)
        for k, step in zip(group, steps, strict=True)
        if parent.projected.usable[k]
    ]
    return all(one.low <= one.value + by <= one.high for one, by in reached)


def _score(parent: TestedHypothesis, group: Sequence[int]) -> float:
    """Sum of squares that these directions remove together."""
    return parent.projected.block(np.asarray(group))[0]


def _forms(parent: TestedHypothesis) -> dict[str, list[list[int]]]:
    """Of each mechanism, its directions in groups of one form and one choice of shapes."""
    by_id: dict[str, list[int]] = {}
    for k, direction in enumerate(parent.directions):
        if direction.mechanism:
            by_id.setdefault(direction.mechanism, []).append(k)
    return {identity: acting_together(parent.directions, indices) for identity, indices in by_id.items()}


def _screened(parent: TestedHypothesis) -> list[tuple[str, float]]:
    """Mechanisms that the residual has any room for, with their score as a share of the best, best first."""
    scores = {
        identity: max(_score(parent, group) for group in groups)
        for identity, groups in _forms(parent).items()
    }
    top = max(scores.values(), default=0.0) or 1.0
    ranking = sorted(((identity, score / top) for identity, score in scores.items()), key=lambda one: -one[1])
    size = len(parent.hypothesis.mechanisms)
    return ranking[: MOST_CHILDREN[size >= GROWN]] if size else ranking


def _runner(parent: TestedHypothesis, group: Sequence[int], factor: float) -> Candidate:
    """`group`: directions of one form and shape of each mechanism that is added."""
    hypothesis = parent.hypothesis
    identities = tuple(dict.fromkeys(parent.directions[k].mechanism for k in group))
    forms = {parent.directions[k].mechanism: parent.directions[k].form for k in group}
    simulation = neutral = hypothesis.simulation.extended(identities)
    at = {
        (p.mechanism, p.declared.name): k for k, p in enumerate(simulation.parameters) if p.mechanism in forms
    }
    values = np.array([parameter.value for parameter in simulation.parameters])
    still = set(hypothesis.still) | (defaulted(simulation) - defaulted(hypothesis.simulation))
    for mechanism in simulation.mechanisms[-len(identities) :]:
        still |= {
            f"{mechanism.id}.{one.name}"
            for one in mechanism.amplitudes
            if mechanism.form_of(one.name) != forms[mechanism.id]
        }
    own: dict[tuple[str, str], FloatArray] = {}
    steps = _joint_step(parent.projected, len(hypothesis.shared), group)
    way = _given_way(parent, group, steps)
    factor = min(factor, _longest(parent, way))
    free = hypothesis.sensitivity.free
    values[free] += factor * way * hypothesis.sensitivity.scale
    shaped = np.array([parameter.value for parameter in neutral.parameters])
    for k, step in zip(group, steps, strict=True):
        direction = parent.directions[k]
        index = at[direction.mechanism, direction.name]
        for name, value in direction.shapes.items():
            values[at[direction.mechanism, name]] = shaped[at[direction.mechanism, name]] = value
        if direction.record != ALL:
            of_each = own.setdefault((direction.mechanism, direction.name), np.zeros(len(hypothesis.starts)))
            of_each[direction.record] = factor * step * direction.scale
        elif parent.projected.usable[k]:
            values[index] += factor * step * direction.scale
        else:
            still.add(simulation.parameters[index].name)
    starts = np.column_stack((hypothesis.starts, *own.values()))
    return Candidate(
        mechanisms=(*hypothesis.mechanisms, *identities), simulation=start_of(simulation, values), starts=starts,
        still=frozenset(still), neutral=start_of(neutral, shaped), parent=hypothesis,
        form="".join(forms.values()),
    )  # fmt: skip


def _given_way(parent: TestedHypothesis, group: Sequence[int], steps: FloatArray) -> FloatArray:
    """(p,) by how much the set's own parameters make room for `steps`, scaled; zero where they hardly follow them."""
    projected, shared = parent.projected, len(parent.hypothesis.shared)
    chosen = np.asarray(group)
    if projected.visible[chosen].max() > COLLINEAR:
        return np.zeros(shared)
    sizes = np.where(projected.usable[chosen], steps, 0.0) * projected.scale[1 + shared + chosen]
    way: FloatArray = -(sizes @ projected.followed[chosen]) / projected.scale[1 : 1 + shared]
    return way


def _longest(parent: TestedHypothesis, way: FloatArray) -> float:
    """Factor of `way` (p,) beyond which one of the set's own parameters would leave all that is linear about it.

    A stiffness that made room by several times itself would have another sign.
    """
    most = FURTHEST * np.maximum(np.abs(parent.hypothesis.shared), 1.0)
    return float(np.min(most / np.maximum(np.abs(way), 1e-300), initial=np.inf))


def _joint_step(projected: Projected, shared: int, group: Sequence[int]) -> FloatArray:
    """Least-squares steps along directions that act together."""
    index = 1 + np.asarray(group)
    matrix = projected.left[np.ix_(index, index)]
    right = -projected.left[index, 0]
    solved = np.linalg.lstsq(matrix + 1e-9 * np.eye(len(index)), right, rcond=1e-9)[0]
    steps: FloatArray = solved * projected.scale[0] / projected.scale[shared + index]
    return steps
