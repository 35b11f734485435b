"""The sentence in which a mechanism of the catalogue states its effect, with values and units."""

from __future__ import annotations

import string
from collections.abc import Mapping
from typing import Protocol

from rtctl.border.mechanisms import Mechanism, plain_unit
from rtctl.border.simulation import Simulation
from rtctl.output.readable_units import readable


class Quantity(Protocol):
    """A value with its unit, as a fitted parameter or an estimate has them."""

    @property
    def value(self) -> float:
        """Value in `unit`."""
        ...

    @property
    def unit(self) -> str:
        """Unit, "1" where there is none."""
        ...


def state_simulated(simulation: Simulation, identity: str) -> str:
    """Return the sentence of the mechanism `identity` with the values that it has in `simulation`."""
    values = {one.declared.name: one for one in simulation.parameters if one.mechanism == identity}
    return state_mechanism(next(one for one in simulation.mechanisms if one.id == identity), values)


def state_mechanism(mechanism: Mechanism, quantities: Mapping[str, Quantity]) -> str:
    """Return the mechanism's sentence with values and units; "?" stands for what is not in `quantities`."""
    template = mechanism.sentence({name: quantity.value for name, quantity in quantities.items()})
    names = {name for _, name, _, _ in string.Formatter().parse(template) if name}
    filled = {
        name: readable(quantities[name].value, plain_unit(quantities[name].unit))
        if name in quantities
        else "?"
        for name in names
    }
    aside = mechanism.aside({name: (one.value, plain_unit(one.unit)) for name, one in quantities.items()})
    return " ".join(filter(None, (template.format(**filled), aside)))
