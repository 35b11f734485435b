"""A checked model: its equations as trees in SI base units, its numbers with the factors to these units.

    dx/dt = rate(x, u, t, parameters),   y = value(x, u, t, parameters),   x := set(x, u, t, parameters) at events

All numbers inside are in SI base units, so that a plain product of two quantities is right whatever their units in
the file are; `factor` converts a number of the file to them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from plant_sim.equations.language.tree import Number, Tree, names_in


@dataclass(frozen=True, slots=True, kw_only=True)
class Input:
    """An input; `factor` SI units are one of its unit."""

    name: str
    unit: str
    factor: float


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A state and its equation."""

    name: str
    unit: str
    factor: float
    rate: Tree
    initial: float
    """Value [SI] at the first sample of a record that states none."""
    low: float = -math.inf
    """Limit [SI]: the state stays there while its rate points outward."""
    high: float = math.inf
    known: bool = False
    """Whether a fit takes `initial` as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """An output; `factor` SI units are one of its unit."""

    name: str
    unit: str
    factor: float
    value: Tree


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """States that are set anew where an expression passes zero."""

    name: str
    when: Tree
    """What passes zero."""
    direction: int
    """+1: from below zero to above; -1: from above to below; 0: both."""
    sets: Mapping[str, Tree]
    """Value after the event by state, from the values just before it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Constant:
    """A parameter, with value and bounds in its own unit."""

    name: str
    unit: str
    factor: float
    value: float
    low: float = -math.inf
    high: float = math.inf
    fixed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class System:
    """Equations in the order of their file."""

    inputs: tuple[Input, ...]
    states: tuple[State, ...]
    outputs: tuple[Output, ...]
    parameters: tuple[Constant, ...]
    terms: Mapping[str, Tree] = field(default_factory=dict)
    """Helper terms, each after those that it needs."""
    events: tuple[Event, ...] = ()

    @property
    def discrete(self) -> tuple[bool, ...]:
        """Whether each state changes at events alone, such as a switch: its rate is 0, and an event sets it."""
        set_by_events = {name for one in self.events for name in one.sets}
        return tuple(one.rate == Number(0.0) and one.name in set_by_events for one in self.states)

    @property
    def trees(self) -> tuple[Tree, ...]:
        """Rates of the states, then values of the outputs."""
        return (*(one.rate for one in self.states), *(one.value for one in self.outputs))

    @property
    def settings(self) -> tuple[tuple[int, Tree], ...]:
        """Place (event * states + state) and value of each state that an event sets."""
        at = {one.name: k for k, one in enumerate(self.states)}
        return tuple(
            (e * len(at) + at[name], tree)
            for e, one in enumerate(self.events)
            for name, tree in one.sets.items()
        )

    def needed_terms(self, trees: tuple[Tree, ...]) -> dict[str, Tree]:
        """Return the terms on which `trees` depend, each after those that it needs."""
        wanted = {name for tree in trees for name in names_in(tree)}
        for name in reversed(list(self.terms)):
            if name in wanted:
                wanted |= set(names_in(self.terms[name]))
        return {name: tree for name, tree in self.terms.items() if name in wanted}

    def direct(self, output: Output) -> tuple[str, ...]:
        """Return the inputs in an output's expression and the terms in it."""
        terms = self.needed_terms((output.value,))
        named = {name for tree in (output.value, *terms.values()) for name in names_in(tree)}
        return tuple(one.name for one in self.inputs if one.name in named)


@lru_cache(maxsize=256)
def terms_of_rates(system: System) -> dict[str, Tree]:
    """Return the terms on which the rates depend, each after those that it needs."""
    return system.needed_terms(tuple(one.rate for one in system.states))


@lru_cache(maxsize=256)
def terms_of_events(system: System) -> dict[str, Tree]:
    """Return the terms on which what the events watch depends, each after those that it needs."""
    return system.needed_terms(tuple(one.when for one in system.events))


@lru_cache(maxsize=256)
def terms_of_outputs(system: System) -> dict[str, Tree]:
    """Return the terms on which the outputs depend, each after those that it needs."""
    return system.needed_terms(tuple(one.value for one in system.outputs))


@lru_cache(maxsize=256)
def directly_driven(system: System) -> frozenset[str]:
    """Return the outputs that have an input in them: they bend and jump where it does."""
    return frozenset(one.name for one in system.outputs if system.direct(one))


def ordered(terms: Mapping[str, Tree]) -> dict[str, Tree]:
    """Return `terms`, each after those that it needs.

    Raises:
        ValueError: Some need each other, in a circle.
    """
    done: dict[str, Tree] = {}
    waiting = dict(terms)
    while waiting:
        ready = [
            name for name, tree in waiting.items() if not any(other in waiting for other in names_in(tree))
        ]
        if not ready:
            raise ValueError(_circle(waiting))
        for name in ready:
            done[name] = waiting.pop(name)
    return done


def _circle(waiting: Mapping[str, Tree]) -> str:
    """Return the circle among terms of which each needs another one."""
    path: list[str] = [next(iter(waiting))]
    while path[-1] not in path[:-1]:
        path.append(next(name for name in names_in(waiting[path[-1]]) if name in waiting))
    circle = path[path.index(path[-1]) :]
    return f"an algebraic loop: {' needs '.join(circle)}; break it by a state, or solve the equation for one of them"
