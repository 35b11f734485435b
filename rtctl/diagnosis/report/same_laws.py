"""Mechanisms that are one law: a search fits one of them, and an answer names both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rtctl.border.simulation import Simulation


def find_same_laws(simulation: Simulation, ids: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return by mechanism those of `ids` that are the same law on the side that a search leaves to it."""
    found: dict[str, tuple[str, ...]] = {}
    for one in ids:
        for parameter in simulation.extended((one,)).mechanisms[-1].parameters:
            if parameter.opposite:
                found[parameter.opposite] = (*found.get(parameter.opposite, ()), one)
    return found


def add_same_laws(names: Sequence[str], own: str, same_laws: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the `names` that could stand in place of `own`, each before those that are one law with it."""
    found = [one for name in (own, *names) for one in (name, *same_laws.get(name, ()))]
    return tuple(one for one in dict.fromkeys(found) if one != own)
