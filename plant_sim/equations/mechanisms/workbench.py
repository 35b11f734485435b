"""A system with the terms of whole families of mechanisms, all switched by parameters: one kernel for many hypotheses.

A search tries dozens of mechanisms. Compiled one by one, each would take a second; compiled together, a term whose
parameter is zero costs a few multiplications a step.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

from plant_sim.equations.language.parser import parse
from plant_sim.equations.language.tree import Name, Number, Operation, Tree, substituted
from plant_sim.equations.mechanisms.catalogue import catalogue
from plant_sim.equations.mechanisms.mechanism import EquationsMechanism
from plant_sim.equations.mechanisms.sizes import Sizes
from plant_sim.equations.mechanisms.states import IDLE
from plant_sim.equations.mechanisms.words import Names
from plant_sim.equations.reading import factor_of
from plant_sim.equations.system import Constant, Input, State, System, ordered

PUSH = "push"
"""Name of the family of inputs that are added to the rates."""


class Workbench(NamedTuple):
    """A system with further terms."""

    system: System
    companions: tuple[int, ...]
    """Position of the state with which each added state begins."""


@lru_cache(maxsize=64)
def workbench(system: System, families: frozenset[str]) -> Workbench:
    """Return `system` with the terms of all mechanisms of some families, neutral, and an input added to each rate.

    Its states are those of `system` and then the companions, its parameters those of `system` and then those of the
    mechanisms under their names in the equations, its inputs those of `system` and then one for each state.
    """
    own = [one for one in catalogue(system, {}, Sizes()).values() if one.family and one.family in families]
    at = {one.name: k for k, one in enumerate(system.states)}
    companions = tuple(at[one.target] for one in own if one.companion)
    return Workbench(with_terms(system, own, push=True), companions)


def with_terms(system: System, mechanisms: Iterable[EquationsMechanism], *, push: bool = False) -> System:
    """Return `system` with the terms of mechanisms, each idle; with an input on each rate if `push`."""
    mechanisms = list(mechanisms)
    changed, terms = _changed_parameters(system, mechanisms)
    names = Names(system)
    pushed = {one.name: names.new(f"{PUSH}_{one.name}") for one in system.states} if push else {}
    states = []
    for state in system.states:
        rate = substituted(state.rate, changed)
        for one in mechanisms:
            if one.target == state.name and one.text and one.id.startswith("state."):
                rate = Operation("+", rate, parse(one.text))
        if push:
            rate = Operation("+", rate, Name(pushed[state.name]))
        states.append(replace(state, rate=rate))
    starts = {one.name: one for one in system.states}
    companions = [
        State(
            name=one.companion, unit=starts[one.target].unit, factor=starts[one.target].factor,
            rate=parse(one.companion_rate), initial=starts[one.target].initial, known=True,
        )
        for one in mechanisms if one.companion
    ]  # fmt: skip
    own_terms = {name: substituted(tree, changed) for name, tree in system.terms.items()}
    return System(
        inputs=(*system.inputs, *(
            Input(name=pushed[one.name], unit=f"({one.unit})/s", factor=one.factor) for one in system.states if push
        )),
        states=(*states, *companions),
        outputs=tuple(replace(one, value=substituted(one.value, changed)) for one in system.outputs),
        parameters=(*system.parameters, *constants_of(mechanisms)),
        terms=ordered(own_terms | terms),
        events=tuple(
            replace(
                one,
                when=substituted(one.when, changed),
                sets={name: substituted(tree, changed) for name, tree in one.sets.items()},
            )
            for one in system.events
        ),
    )  # fmt: skip


def _changed_parameters(
    system: System, mechanisms: Iterable[EquationsMechanism]
) -> tuple[dict[str, Tree], dict[str, Tree]]:
    """Return what stands in place of each changed parameter, and the terms that define it."""
    names, changed, terms = Names(system), dict[str, Tree](), dict[str, Tree]()
    for parameter in system.parameters:
        factor: Tree = Number(1.0)
        for one in mechanisms:
            if one.target == parameter.name and one.id.startswith("parameter."):
                factor = Operation("+", factor, parse(one.text))
        if factor != Number(1.0):
            name = names.new(f"{parameter.name}_now")
            terms[name] = Operation("*", Name(parameter.name), factor)
            changed[parameter.name] = Name(name)
    return changed, terms


def constants_of(mechanisms: Iterable[EquationsMechanism]) -> list[Constant]:
    """Return the parameters of the terms of mechanisms at idle values, and their references."""
    found: dict[str, Constant] = {}
    for mechanism in mechanisms:
        for declared in mechanism.parameters:
            factor = factor_of(declared.unit)
            idle = declared.neutral if declared.neutral is not None else IDLE.get(declared.name, 1.0) / factor
            name = mechanism.names[declared.name]
            found[name] = Constant(name=name, unit=declared.unit, factor=factor, value=idle)
        found |= {
            name: Constant(name=name, unit=unit, factor=factor_of(unit), value=value, fixed=True)
            for name, (unit, value) in mechanism.references.items()
        }
    return list(found.values())
