"""More general laws: where no set passes, each law of the best one is tried as a case of a law with more parameters.

A search that has used up its work may never have come to Stribeck's law beside two stops, or to Bouc and Wen's beside a
reading that is late: but the case of it that was found is near, and is where a fit begins.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.bounds import clip_to_bounds
from rtctl.diagnosis.problem.fit import defaulted, fit_hypothesis, polish
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.shape_grid import shape_grid
from rtctl.diagnosis.search.state import SearchSettings


class Start(NamedTuple):
    """Values from which a set with a more general law is fitted."""

    mechanisms: tuple[str, ...]
    simulation: Simulation
    fixed_parameters: frozenset[str]


def fit_general_laws(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, settings: SearchSettings
) -> list[Hypothesis]:
    """Fit the set with each of its laws as a case of a more general one, lowest cost first.

    Args:
        problem: Records to fit.
        nominal: Fitted nominal model.
        chosen: Best set that was found, which does not pass.
        settings: Mechanisms that are searched, and the budget, beyond which this may go by a bounded amount.
    """
    limits, budget = problem.thresholds.search, settings.for_rivals().budget
    problem, fits = problem.until(budget), []
    for start in starts_of_general_laws(problem, nominal, chosen, settings.ids):
        if budget.spent:
            break
        settings.report(" + ".join(start.mechanisms))
        fit = fit_hypothesis(
            problem,
            start.simulation,
            start.mechanisms,
            chosen.starts,
            limits.second_iterations,
            start.fixed_parameters,
        )
        if fit is not None:
            further = polish(problem, fit, limits.last_iterations)
            fits.append(further if further is not None and further.cost < fit.cost else fit)
    return sorted(fits, key=lambda one: one.cost)


def starts_of_general_laws(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, ids: Sequence[str]
) -> Iterator[Start]:
    """Yield the set with a more general law in place of one, at the values of those parameters that both have.

    A shape that the case lacks says where the laws differ, and a fit from elsewhere may not find it: each is tried at
    the values that a search tries.
    """
    added = [name for name in chosen.mechanisms if name not in nominal.mechanisms]
    laws = nominal.simulation.extended(tuple(one for one in ids if one not in nominal.mechanisms)).mechanisms
    for name in added:
        for law in laws:
            if name in law.generalises and law.id not in chosen.mechanisms:
                yield from _starts_of(problem, nominal, chosen, name, law.id)


def _starts_of(
    problem: Problem, nominal: Hypothesis, chosen: Hypothesis, simpler: str, general: str
) -> Iterator[Start]:
    mechanisms = tuple(general if name == simpler else name for name in chosen.mechanisms)
    simulation = nominal.simulation.extended(
        tuple(name for name in mechanisms if name not in nominal.mechanisms)
    )
    (law,) = (one for one in simulation.mechanisms if one.id == general)
    own = {one.declared.name: one for one in simulation.parameters if one.mechanism == general}
    told = law.generalises[simpler]({name: one.value for name, one in own.items()})
    shared = [name for name in told if name in own]
    known = {one.name: one.value for one in chosen.simulation.parameters}
    known |= {f"{general}.{name}": known[f"{simpler}.{name}"] for name in shared}
    names = {one.name for one in simulation.parameters}
    fixed_parameters = (chosen.fixed_parameters & names) | (
        defaulted(simulation) & {one.name for one in own.values()}
    )
    lacking = [name for name, one in own.items() if one.declared.is_shape and name not in shared]
    choices = dict.fromkeys(
        tuple(one.values[name] for name in lacking) for one in shape_grid(law, problem, ())
    )
    for choice in choices:
        values = known | {f"{general}.{name}": value for name, value in zip(lacking, choice, strict=True)}
        moved = np.array([values.get(one.name, one.value) for one in simulation.parameters])
        yield Start(mechanisms, clip_to_bounds(simulation, moved), fixed_parameters)
