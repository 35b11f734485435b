"""Names of what mechanisms add to the equations, and the values from which a course is counted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.reading import start_values
from plant_sim.equations.system import State, System
from rtctl.border.units.quantities import unit_registry
from rtctl.border.units.unit_text import parsed_unit


class Names:
    """Names that are taken in a system, so that an added one is new."""

    def __init__(self, system: System) -> None:
        tables = (system.inputs, system.states, system.outputs, system.parameters)
        self._taken = {one.name for table in tables for one in table} | set(system.terms)

    def new(self, wanted: str) -> str:
        """Return `wanted`, or with a number where it is taken; it is taken from now on."""
        name, k = wanted, 2
        while name in self._taken:
            name, k = f"{wanted}_{k}", k + 1
        self._taken.add(name)
        return name


@lru_cache(maxsize=256)
def is_temperature(unit: str) -> bool:
    """Return whether a unit is one of temperature: its zero is far from anything that moves."""
    return bool(parsed_unit(unit).dimensionality == unit_registry().kelvin.dimensionality)


def reference_of(state: State) -> float:
    """Return the value, in its unit, from which a state is counted: its start where it is a temperature, else zero."""
    return state.initial / state.factor if is_temperature(state.unit) else 0.0


@lru_cache(maxsize=256)
def output_reference(system: System, name: str) -> float:
    """Return the value [SI] from which an output is counted: at the model's start where it is a temperature, else 0."""
    output = next(one for one in system.outputs if one.name == name)
    if not is_temperature(output.unit):
        return 0.0
    values = start_values(system, {one.name: 0.0 for one in system.inputs})
    found = float(evaluate(output.value, values))
    return found if math.isfinite(found) else 0.0


def counted(name: str, references: Mapping[str, str]) -> str:
    """Return the text of a course counted from its reference."""
    return f"({name} - {references[name]})" if name in references else name
