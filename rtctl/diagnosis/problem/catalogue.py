"""The catalogue as a search takes it: what a fit can follow, and mechanisms that are one law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rtctl.border.simulation import Simulation


def list_fitted(simulation: Simulation, ids: Sequence[str]) -> tuple[str, ...]:
    """Return those of `ids` that a fit can follow: not what the levels of the readings show."""
    return tuple(one for one in ids if not simulation.extended((one,)).mechanisms[-1].by_levels)


def find_same_laws(simulation: Simulation, ids: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return by mechanism those of `ids` that are the same law on the side that a search leaves to it."""
    found: dict[str, tuple[str, ...]] = {}
    for one in ids:
        for parameter in simulation.extended((one,)).mechanisms[-1].parameters:
            if parameter.opposite:
                found[parameter.opposite] = (*found.get(parameter.opposite, ()), one)
    return found


def with_same_laws(
    names: Sequence[str], own: str, same_laws: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Return the `names` that could stand in place of `own`, with those that are one law with it or with them."""
    others = [one for name in (own, *names) for one in same_laws.get(name, ())]
    return tuple(one for one in dict.fromkeys((*names, *others)) if one != own)


def without_steps(simulation: Simulation) -> Simulation:
    """Return a model whose readings are not rounded: no derivative shows what rounding does."""
    rounding = {one.id for one in simulation.mechanisms if one.by_levels}
    values = np.array(
        [
            one.declared.neutral if one.mechanism in rounding and one.declared.neutral is not None else one.value
            for one in simulation.parameters
        ]
    )
    return simulation.with_values(values) if rounding else simulation
