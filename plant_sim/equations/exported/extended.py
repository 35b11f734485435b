"""A model's equations with the terms of its mechanisms in them, for exports that have no other form of a mechanism."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from plant_sim.equations.mechanisms.mechanism import EquationsMechanism
from plant_sim.equations.mechanisms.words import output_reference
from plant_sim.equations.mechanisms.workbench import with_terms
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import system_of
from plant_sim.equations.simulation import EquationsSimulation
from plant_sim.equations.system import System
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CVariable


@dataclass(frozen=True, slots=True, kw_only=True)
class Outside:
    """A mechanism of a signal: it acts before the equations, or behind them."""

    mechanism: EquationsMechanism
    variables: tuple[CVariable, ...]
    """Its parameters."""
    reference: float = 0.0
    """Value of an output from which its saturation counts, in its unit."""

    @property
    def id(self) -> str:
        """Id of the mechanism."""
        return self.mechanism.id

    @property
    def signal(self) -> str:
        """Input or output on which it acts."""
        return self.mechanism.signal

    @property
    def is_input(self) -> bool:
        """Whether it acts on an input."""
        return self.mechanism.acts_on_input

    @property
    def law(self) -> str:
        """Last word of its id."""
        return self.id.rpartition(".")[2]

    @property
    def stage(self) -> int:
        """Order among those of one signal."""
        return self.mechanism.law.stage if self.mechanism.law else 0

    @property
    def c_name(self) -> str:
        """Its name in C."""
        return self.id.replace(".", "_")

    @property
    def values(self) -> Mapping[str, float]:
        """Values of its parameters, by their names in the law."""
        return {one.name.removeprefix(f"{self.id}."): one.value for one in self.variables}


def parted_system(model: EquationsFile, source: str) -> tuple[System, tuple[Outside, ...]]:
    """Return the equations with the terms of mechanisms, and the mechanisms that are no terms.

    Raises:
        InputError: The rates are functions of a Python class.
    """
    if model.model.python:
        raise InputError(
            f"{source}: model.python: the rates are functions of {model.model.python}, which other programs cannot "
            "call; write them as expressions in [model.states]"
        )
    system = system_of(model, source)
    if not model.model.mechanisms:
        return system, ()
    units = {one.name: one.unit for one in system.inputs} | {one.name: one.unit for one in system.outputs}
    simulation = equations_simulation(model, units, source)
    outside = tuple(_outside(simulation, one) for one in simulation.mechanisms if not one.family)
    return _with_terms(system, simulation), tuple(one for one in outside if _acts(simulation, one.mechanism))


def _acts(simulation: EquationsSimulation, mechanism: EquationsMechanism) -> bool:
    return any(
        one.value != one.declared.neutral
        for one in simulation.parameters
        if one.mechanism == mechanism.id and one.declared.neutral is not None
    )


def _outside(simulation: EquationsSimulation, mechanism: EquationsMechanism) -> Outside:
    variables = tuple(
        CVariable(
            name=one.name, unit=one.unit, value=one.value, meaning=one.declared.meaning,
            low=one.low if math.isfinite(one.low) else None, high=one.high if math.isfinite(one.high) else None,
        )
        for one in simulation.parameters if one.mechanism == mechanism.id
    )  # fmt: skip
    reference = 0.0
    if not mechanism.acts_on_input:
        output = next(one for one in simulation.system.outputs if one.name == mechanism.signal)
        reference = output_reference(simulation.system, output.name) / output.factor
    return Outside(mechanism=mechanism, variables=variables, reference=reference)


def expressed_system(model: EquationsFile, source: str) -> System:
    """Return the extended equations for a program that has no Python.

    Raises:
        InputError: The rates are functions of a Python class, or a mechanism is no term.
    """
    if model.model.python:
        raise InputError(
            f"{source}: model.python: the rates are functions of {model.model.python}, which other programs cannot "
            "call; write them as expressions in [model.states]"
        )
    return extended_system(model, source)


def extended_system(model: EquationsFile, source: str) -> System:
    """Return the equations with the terms of the model's mechanisms. Raises InputError for one that is no term."""
    system = system_of(model, source)
    if not model.model.mechanisms:
        return system
    units = {one.name: one.unit for one in system.inputs} | {one.name: one.unit for one in system.outputs}
    simulation = equations_simulation(model, units, source)
    without_form = [one.id for one in simulation.mechanisms if not one.family]
    if without_form:
        raise InputError(
            f"{source}: {', '.join(without_form)} is no term of the equations: what acts on a signal before it "
            "reaches the equations, or behind them, is outside of them; take the table out, or write "
            "it as equations"
        )
    return _with_terms(system, simulation)


def _with_terms(system: System, simulation: EquationsSimulation) -> System:
    own = tuple(one for one in simulation.mechanisms if one.family)
    if not own:
        return system
    extended = with_terms(system, own)
    values = {
        one.names[declared.name]: parameter.value
        for one in own
        for declared in one.parameters
        for parameter in simulation.parameters
        if parameter.name == f"{one.id}.{declared.name}"
    }
    parameters = tuple(replace(one, value=values.get(one.name, one.value)) for one in extended.parameters)
    return replace(extended, parameters=parameters)
