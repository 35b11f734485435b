"""Candidates: starts of larger sets, from linear estimates of the added mechanisms' sizes in their best shapes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.bounds import clip_to_bounds
from rtctl.diagnosis.problem.fit import defaulted
from rtctl.diagnosis.residual.directions import ALL, Direction, group_by_shapes, parameters_by_name
from rtctl.diagnosis.residual.projection import Projected
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.successive_halving import Candidate
from rtctl.diagnosis.thresholds import SearchThresholds


def propose_candidates(
    parent: TestedHypothesis, limits: SearchThresholds, least: float = 0.0
) -> list[Candidate]:
    """Return the parent's set with each further mechanism, from the linear estimate of its size in its best shapes.

    Args:
        parent: Tested set that is extended.
        limits: Thresholds of the search.
        least: Share of the best mechanism's score below which a mechanism is left out.
    """
    candidates = []
    large = len(parent.hypothesis.mechanisms) >= limits.beam_size
    for identity, strength in _rank_mechanisms(parent, limits):
        if strength < least or _is_related(parent, identity):
            continue
        own = [k for k, direction in enumerate(parent.directions) if direction.mechanism == identity]
        groups = sorted(group_by_shapes(parent.directions, own), key=lambda group: -_score(parent, group))
        once = strength < limits.weak_share or large
        factors = limits.start_factors[: 1 if once else None]
        for form in dict.fromkeys(parent.directions[group[0]].form for group in groups):
            of_form = [group for group in groups if parent.directions[group[0]].form == form]
            for group in of_form[:1] if once else _select_shapes(parent, of_form, limits):
                moves = _feasible_step(parent, group).any()
                candidates += [
                    _start_candidate(parent, group, factor, limits)
                    for factor in factors[: None if moves else 1]
                ]
    return [*candidates, *_propose_along_valleys(parent, limits)]


def _propose_along_valleys(parent: TestedHypothesis, limits: SearchThresholds) -> list[Candidate]:
    """Return the parent's set with each mechanism that is, to first order, one of the parent's own.

    A small lag is a delay, and what they differ by is of the third order: the linear estimate says nothing, and a fit
    from there stays where it is. So it starts away from there, and the parent's own parameters make room for it.
    """
    if not parent.hypothesis.mechanisms:
        return []
    candidates = []
    for identity, groups in _group_directions(parent).items():
        group = groups[0]
        if not any(parent.projected.usable[k] for one in groups for k in one) and not _is_related(
            parent, identity
        ):
            candidates += [_start_in_valley(parent, group, share, limits) for share in limits.valley_shares]
    return [one for one in candidates if one is not None]


def interleave(groups: Sequence[Sequence[Candidate]]) -> list[Candidate]:
    """Return the candidates of several parents in the order in which they are fitted.

    First starts of all sets come first, the best sets of every parent before any second best; then further starts.
    Where the budget is spent, no set goes without a fit for another set's second start.
    """
    order = []
    for group in groups:
        ranks: dict[tuple[tuple[str, ...], str], int] = {}
        starts = Counter[tuple[tuple[str, ...], str]]()
        for candidate in group:
            key = (candidate.mechanisms, candidate.form)
            rank = ranks.setdefault(key, len(ranks))
            order.append((starts[key], rank, candidate))
            starts[key] += 1
    return [candidate for _, _, candidate in sorted(order, key=lambda entry: entry[:2])]


def propose_pairs(parent: TestedHypothesis, limits: SearchThresholds) -> list[Candidate]:
    """Return the parent's set with two further mechanisms at once, of those pairs that promise most together.

    One effect alone moves the nominal parameters until the other, beside it, is far from its right value, and a pair
    that is no neighbour of the best single cause would never be tried.
    """
    groups_of = _group_directions(parent)
    best, grouped = [], {name: own for name, own in groups_of.items() if not _is_related(parent, name)}
    laws = {name: parent.hypothesis.simulation.extended((name,)).mechanisms[-1] for name in grouped}
    for (name, first), (rival, second) in combinations(grouped.items(), 2):
        if laws[name].is_related_to(laws[rival]):
            continue
        groups = ([*one, *other] for one, other in product(first, second))
        best.append(max(((_score(parent, group), group) for group in groups), key=lambda scored: scored[0]))
    best.sort(key=lambda scored: -scored[0])
    return [
        _start_candidate(parent, group, limits.pair_factor, limits) for _, group in best[: limits.pairs_tried]
    ]


def _select_shapes(
    parent: TestedHypothesis, groups: Sequence[list[int]], limits: SearchThresholds
) -> Sequence[list[int]]:
    """Select the choices of shapes of one form, best first, from which fits start.

    Frequencies have separate valleys: a fit that ends at a bound at once does not go on to the next one.
    """
    identity = parent.directions[groups[0][0]].mechanism
    known = parameters_by_name(parent.hypothesis.simulation.extended((identity,)), identity)
    if not any(one.declared.is_shape and one.unit == "Hz" for one in known.values()):
        return groups[: limits.shapes_tried]
    feasible = [group for group in groups if _is_within_bounds(parent, group)]
    return (feasible or groups)[: limits.frequencies_tried]


def _is_within_bounds(parent: TestedHypothesis, group: Sequence[int]) -> bool:
    """Return whether the linear step stays within bounds: a mass that would have to be negative is no start."""
    steps = _solve_joint_step(parent.projected, len(parent.hypothesis.shared), group)
    return all(
        parent.directions[k].least <= step <= parent.directions[k].most
        for k, step in zip(group, steps, strict=True)
        if parent.projected.usable[k]
    )


def _is_related(parent: TestedHypothesis, identity: str) -> bool:
    """Return whether a mechanism is a case of one that the set has, or the other way round."""
    *own, added = parent.hypothesis.simulation.extended((identity,)).mechanisms
    return any(added.is_related_to(one) for one in own)


def _score(parent: TestedHypothesis, group: Sequence[int]) -> float:
    """Return the sum of squares that these directions remove together, by steps of either sign.

    Far from the truth the sign of a linear step says little: whether bounds allow it decides where a fit starts, and
    not whether there is one.
    """
    return parent.projected.block(np.asarray(group))[0]


def _group_directions(parent: TestedHypothesis) -> dict[str, list[list[int]]]:
    """Return each mechanism's directions in groups of one form and one choice of shapes."""
    by_id: dict[str, list[int]] = {}
    for k, direction in enumerate(parent.directions):
        if direction.mechanism:
            by_id.setdefault(direction.mechanism, []).append(k)
    return {identity: group_by_shapes(parent.directions, indices) for identity, indices in by_id.items()}


def _rank_mechanisms(parent: TestedHypothesis, limits: SearchThresholds) -> list[tuple[str, float]]:
    """Return the mechanisms that extend the set, with their score as a share of the best one's, best first."""
    scores = {
        identity: max(_score(parent, group) for group in groups)
        for identity, groups in _group_directions(parent).items()
    }
    top = max(scores.values(), default=0.0) or 1.0
    ranking = sorted(
        ((identity, score / top) for identity, score in scores.items()), key=lambda ranked: -ranked[1]
    )
    size = len(parent.hypothesis.mechanisms)
    if not size:
        return ranking
    return ranking[: limits.children_of_single if size < limits.beam_size else limits.children_of_larger]


def _start_candidate(
    parent: TestedHypothesis, group: Sequence[int], factor: float, limits: SearchThresholds
) -> Candidate:
    """Return the parent's set, extended, at `factor` times the linear step that bounds allow.

    Args:
        parent: Tested set that is extended.
        group: Directions of one form and one choice of shapes of each added mechanism.
        factor: Factor of the linear step.
        limits: Thresholds of the search.
    """
    projected = parent.projected
    usable = projected.usable[np.asarray(group)]
    steps = _feasible_step(parent, group)
    room = _make_room(parent, group, steps, limits)
    return candidate_at(parent, group, steps, room, min(factor, _limit_step(parent, room, limits)), usable)


def _start_in_valley(
    parent: TestedHypothesis, group: Sequence[int], share: float, limits: SearchThresholds
) -> Candidate | None:
    """Return the parent's set, extended, at a share of the way to where one of its own parameters meets a bound."""
    steps = np.zeros(len(group))
    steps[0] = 1.0
    room = _follow(parent, group, steps)
    step = min(1.0, _limit_step(parent, room, limits), _room_within_bounds(parent, room))
    fitted = np.ones(len(group), dtype=bool)
    return candidate_at(parent, group, steps, room, share * step, fitted) if step > 0.0 else None


def candidate_at(
    parent: TestedHypothesis,
    group: Sequence[int],
    steps: FloatArray,
    room: FloatArray,
    factor: float,
    fitted: NDArray[np.bool_],
) -> Candidate:
    """Return the parent's set, extended, at `factor` times `steps` along the directions and `room` of its own.

    Args:
        parent: Tested set that is extended.
        group: Directions of one form and one choice of shapes of each added mechanism.
        steps: (g,) steps along these directions.
        room: (p,) scaled steps of the set's own parameters.
        factor: Factor of all these steps.
        fitted: (g,) which of the directions are fitted; the parameters of the others stay neutral.
    """
    hypothesis, directions = parent.hypothesis, [parent.directions[k] for k in group]
    forms = {direction.mechanism: direction.form for direction in directions}
    simulation = neutral = hypothesis.simulation.extended(tuple(forms))
    index = {
        (p.mechanism, p.declared.name): k for k, p in enumerate(simulation.parameters) if p.mechanism in forms
    }
    fixed_parameters = set(hypothesis.fixed_parameters) | _list_fixed(
        hypothesis.simulation, simulation, forms
    )
    shaped = np.array([parameter.value for parameter in neutral.parameters])
    for direction in directions:
        for name, value in direction.shapes.items():
            shaped[index[direction.mechanism, name]] = value
    values = shaped.copy()
    values[hypothesis.sensitivity.free] += factor * room * hypothesis.sensitivity.scale
    of_record: dict[tuple[str, str], FloatArray] = {}
    for direction, step, is_fitted in zip(directions, steps, fitted, strict=True):
        key = direction.mechanism, direction.name
        if direction.record != ALL:
            amplitudes = of_record.setdefault(key, np.zeros(len(hypothesis.starts)))
            amplitudes[direction.record] = factor * step * direction.scale
        elif is_fitted:
            values[index[key]] += factor * step * direction.scale
        else:
            fixed_parameters.add(simulation.parameters[index[key]].name)
    return Candidate(
        mechanisms=(*hypothesis.mechanisms, *forms), simulation=clip_to_bounds(simulation, values),
        starts=np.column_stack((hypothesis.starts, *of_record.values())), fixed_parameters=frozenset(fixed_parameters),
        neutral=clip_to_bounds(neutral, shaped), parent=hypothesis, form="".join(forms.values()),
    )  # fmt: skip


def _room_within_bounds(parent: TestedHypothesis, room: FloatArray) -> float:
    """Return the factor of `room` (p,) at which the first of the set's own parameters meets a bound."""
    hypothesis = parent.hypothesis
    most = np.inf
    for k, by in zip(hypothesis.sensitivity.free, room * hypothesis.sensitivity.scale, strict=True):
        one = hypothesis.simulation.parameters[k]
        bound = one.high if by > 0.0 else one.low
        if by != 0.0:
            most = min(most, max((bound - one.value) / by, 0.0))
    return float(most)


def _list_fixed(before: Simulation, after: Simulation, forms: Mapping[str, str]) -> set[str]:
    """Return the names of the added mechanisms' parameters that are not fitted: defaulted shapes and other forms."""
    fixed = set(defaulted(after) - defaulted(before))
    for mechanism in after.mechanisms[-len(forms) :]:
        amplitudes = [one.name for one in mechanism.amplitudes]
        fixed |= {
            f"{mechanism.id}.{name}"
            for name in amplitudes
            if mechanism.form_of(name) not in ("", forms[mechanism.id])
        }
    return fixed


def _make_room(
    parent: TestedHypothesis, group: Sequence[int], steps: FloatArray, limits: SearchThresholds
) -> FloatArray:
    """Return by how much the set's own parameters make room for `steps` (p,), scaled.

    It is zero where the directions are not nearly collinear with the set's own parameters.
    """
    projected, chosen = parent.projected, np.asarray(group)
    if projected.visible[chosen].max() > limits.collinear_share:
        return np.zeros(len(parent.hypothesis.shared))
    return _follow(parent, group, np.where(projected.usable[chosen], steps, 0.0))


def _follow(parent: TestedHypothesis, group: Sequence[int], steps: FloatArray) -> FloatArray:
    """Return by how much the set's own parameters move against `steps` (g,) along directions, scaled (p,)."""
    projected, shared = parent.projected, len(parent.hypothesis.shared)
    chosen = np.asarray(group)
    sizes = steps * projected.scale[1 + shared + chosen]
    moved: FloatArray = -(sizes @ projected.followed[chosen]) / projected.scale[1 : 1 + shared]
    return moved


def _limit_step(parent: TestedHypothesis, room: FloatArray, limits: SearchThresholds) -> float:
    """Return the factor of `room` (p,) beyond which one of the set's own parameters leaves its linear range.

    A stiffness that made room by several times itself would change its sign.
    """
    most = limits.own_step_limit * np.maximum(np.abs(parent.hypothesis.shared), 1.0)
    return float(np.min(most / np.maximum(np.abs(room), 1e-300), initial=np.inf))


def _feasible_step(parent: TestedHypothesis, group: Sequence[int]) -> FloatArray:
    """Return the least-squares steps (g,) along directions that act together, none beyond its neutral bound.

    Of those that would leave it, the one that would do so furthest stays, until no other would (active set).
    """
    steps = np.zeros(len(group))
    moving = [j for j, k in enumerate(group) if parent.projected.usable[k]]
    while moving:
        chosen = [group[j] for j in moving]
        solved = _solve_joint_step(parent.projected, len(parent.hypothesis.shared), chosen)
        blocked = [
            (abs(step) * parent.projected.scale[1 + len(parent.hypothesis.shared) + k], j)
            for j, k, step in zip(moving, chosen, solved, strict=True)
            if _is_blocked(parent.directions[k], step)
        ]
        if not blocked:
            steps[moving] = solved
            break
        moving.remove(max(blocked)[1])
    return steps


def _is_blocked(direction: Direction, step: float) -> bool:
    """Return whether a step would leave the bound at which its parameter is neutral."""
    return (direction.least == 0.0 and step < 0.0) or (direction.most == 0.0 and step > 0.0)


def _solve_joint_step(projected: Projected, shared: int, group: Sequence[int]) -> FloatArray:
    """Return the least-squares steps along directions that act together."""
    index = 1 + np.asarray(group)
    matrix = projected.left[np.ix_(index, index)]
    right = -projected.left[index, 0]
    solved = np.linalg.lstsq(matrix + 1e-9 * np.eye(len(index)), right, rcond=1e-9)[0]
    steps: FloatArray = solved * projected.scale[0] / projected.scale[shared + index]
    return steps
