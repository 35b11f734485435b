"""A model's equations with the terms of its mechanisms in them, for exports that have no other form of a mechanism."""

from __future__ import annotations

from dataclasses import replace

from plant_sim.equations.mechanisms.workbench import with_terms
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import system_of
from plant_sim.equations.system import System
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError


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
    extended = with_terms(system, simulation.mechanisms)
    values = {
        one.names[declared.name]: parameter.value
        for one in simulation.mechanisms
        for declared in one.parameters
        for parameter in simulation.parameters
        if parameter.name == f"{one.id}.{declared.name}"
    }
    parameters = tuple(replace(one, value=values.get(one.name, one.value)) for one in extended.parameters)
    return replace(extended, parameters=parameters)
