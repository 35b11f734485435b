"""What each cause of a set is worth beside the others: the set is fitted again without it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.projection import Rows, project
from rtctl.diagnosis.residual.residual_tests import start_of
from rtctl.identification.noise.residual_noise import NoiseModel

NEGLIGIBLE = 1.1
"""Times the squared misfit: a cause without which no more than this is left is not needed."""
ITERATIONS = 20


def eliminate_negligible(problem: Problem, nominal: Hypothesis, chosen: Hypothesis) -> Hypothesis:
    """`chosen` without the causes that hardly matter, least first; itself where all of them do."""
    while len(_added(nominal, chosen)) > 1:
        rests = refit_without_each(problem, nominal, chosen)
        best = min(rests, key=lambda one: one.cost, default=None)
        if best is None or best.cost > NEGLIGIBLE * chosen.cost:
            break
        chosen = best
    return chosen


def refit_without_each(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, known: Sequence[Hypothesis] = ()
) -> tuple[Hypothesis, ...]:
    """`chosen` less each of its causes in turn; taken from `known` where it is there. Those that diverge are left out.

    Without its only cause a set is `nominal`.
    """
    causes = _added(nominal, chosen)
    if len(causes) < 2:
        return (nominal,) if causes else ()
    by_set = {frozenset(one.mechanisms): one for one in (*known, nominal)}
    found: list[Hypothesis] = []
    for cause in causes:
        rest = tuple(name for name in chosen.mechanisms if name != cause)
        one = by_set.get(frozenset(rest)) or refit_without(problem, nominal, chosen, rest)
        found += [one] if one is not None else []
    return tuple(found)


def _added(nominal: Hypothesis, chosen: Hypothesis) -> tuple[str, ...]:
    return tuple(name for name in chosen.mechanisms if name not in nominal.mechanisms)


def refit_without(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, rest: tuple[str, ...], iterations: int = ITERATIONS,
    below: float = np.inf,
) -> Hypothesis | None:  # fmt: skip
    """The set `rest`, from the values that its parameters have in `chosen`; with 0 iterations just there. None where it
    diverges, or begins at a cost that is not `below`.

    Else from there or from where they make up for what goes as far as they can, whichever is better to begin with: the
    parts of one delay that two laws share would all be left to one.
    """
    added = tuple(name for name in rest if name not in nominal.mechanisms)
    simulation = nominal.simulation.extended(added)
    values = {parameter.name: parameter.value for parameter in chosen.simulation.parameters}
    simulation = simulation.with_values(np.array([values[one.name] for one in simulation.parameters]))
    begins = [simulation]
    if iterations:
        values |= _making_up(problem, chosen, rest)
        begins.append(start_of(simulation, np.array([values[one.name] for one in simulation.parameters])))
    known = {one.name for one in simulation.parameters}
    still = frozenset(name for name in chosen.still if name in known)
    starts = chosen.starts[:, : chosen.states]
    own = [k for k, one in enumerate(simulation.parameters) if one.declared.per_record and not one.fixed]
    if own:
        apart = chosen.sensitivity.record_parameters.tolist()
        kept = [
            chosen.states + position
            for position, k in enumerate(apart)
            if chosen.simulation.parameters[k].name in known
        ]
        starts = np.column_stack((starts, chosen.starts[:, kept]))
    if len(begins) > 1:
        there = [(fit_hypothesis(problem, one, rest, starts, 0, still), one) for one in begins]
        least, simulation = min(
            ((at.cost if at else np.inf, one) for at, one in there), key=lambda pair: pair[0]
        )
        if not least < below:
            return None
    return fit_hypothesis(problem, simulation, rest, starts, iterations, still)


def _making_up(problem: Problem, chosen: Hypothesis, rest: Sequence[str]) -> dict[str, float]:
    """By name, what the parameters that stay would be if the amplitudes of all others went to zero, to first order."""
    parameters = [chosen.simulation.parameters[k] for k in chosen.sensitivity.free]
    stays = [k for k, one in enumerate(parameters) if not one.mechanism or one.mechanism in rest]
    goes = [k for k, one in enumerate(parameters) if k not in stays and one.declared.neutral is not None]
    try:
        lines = chosen.linearise(problem)
    except ArithmeticError:
        return {}
    if not goes or not stays:
        return {}
    rows = [
        Rows(
            residual=line.residual, shared=line.shared[stays], local=line.local, directions=line.shared[goes]
        )
        for line in lines
    ]
    projected = project(rows, [NoiseModel(np.empty(0), 1.0)] * rows[0].residual.shape[0])
    scale = chosen.sensitivity.scale
    gone = chosen.shared[goes] - np.array([parameters[k].declared.neutral for k in goes]) / scale[goes]
    sizes = gone * projected.scale[1 + len(stays) :]
    moved = chosen.shared[stays] + (sizes @ projected.followed) / projected.scale[1 : 1 + len(stays)]
    return dict(zip([parameters[k].name for k in stays], (moved * scale[stays]).tolist(), strict=True))
