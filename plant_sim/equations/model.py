"""A model file bound to the units of a dataset: which signals it has, and in which units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from plant_sim.equations.reading import factor_of, system_of
from plant_sim.equations.simulation import EquationsSimulation
from plant_sim.equations.system import Constant, System
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError, nearest
from rtctl.border.mechanisms import Parameter
from rtctl.border.model_file import MechanismTable
from rtctl.border.simulation import FreeParameter
from rtctl.border.units.unit_text import parsed_unit


def equations_simulation(model: EquationsFile, units: Mapping[str, str], source: str) -> EquationsSimulation:
    """Return the simulation of `model` with its signals in the data's `units`.

    Raises:
        InputError: something in the model is wrong, or its signals are not those of the data; it names `source`.
    """
    system = system_of(model, source)
    problems = signal_problems(system, units)
    if problems:
        raise InputError("\n".join(f"{source}: {text}" for text in problems))
    plain = EquationsSimulation(
        system=system,
        parameters=tuple(free_parameter(one) for one in system.parameters),
        input_factors=np.array([factor_of(units[one.name]) for one in system.inputs]),
        units=dict(units),
        output_factors=np.array([factor_of(units.get(one.name, one.unit)) for one in system.outputs]),
    )
    return with_mechanisms(plain, model.model.mechanisms, source)


def with_mechanisms(
    plain: EquationsSimulation, tables: Sequence[MechanismTable], source: str
) -> EquationsSimulation:
    """Return the simulation with the mechanisms of a file. Raises InputError with every finding; it names `source`."""
    lines = list[str]()
    known = [one for one in tables if plain.has(one.id)]
    for index, table in enumerate(tables):
        if table not in known:
            lines.append(
                f'{source}: model.mechanisms.{index}.id = "{table.id}" is no mechanism of these equations'
                f"{nearest(table.id, plain.catalogue)}"
            )
    if not known:
        extended = plain
    else:
        extended = plain.extended(tuple(one.id for one in known))
    values = [one.value for one in extended.parameters]
    at = {one.name: k for k, one in enumerate(extended.parameters)}
    for table in known:
        lines += [f"{source}: {text}" for text in _fill(table, extended, at, values)]
    if lines:
        raise InputError("\n".join(lines))
    return extended.with_values(np.array(values)) if known else plain


def _fill(
    table: MechanismTable, extended: EquationsSimulation, at: Mapping[str, int], values: list[float]
) -> Iterator[str]:
    """Put the parameters of a mechanism into `values`, and yield what is wrong with them."""
    where = f"the mechanism {table.id}"
    declared = next(one for one in extended.mechanisms if one.id == table.id).parameters
    names = [one.name for one in declared]
    for name in table.parameters.keys() - set(names):
        yield f'{where} has no parameter "{name}"{nearest(name, names)}'
    for one in declared:
        given = table.parameters.get(one.name)
        if given is None:
            if one.default is None:
                yield f"{where} lacks its parameter {one.name} [{one.unit}]"
            continue
        try:
            value = given.to(one.unit)
        except ValueError as error:
            yield f"{where}, parameter {one.name}: {error}"
            continue
        if not one.low <= value <= one.high:
            limits = f"between {one.low:g} and {one.high:g} {one.unit}"
            yield f"{where}, parameter {one.name} = {value:g} {one.unit} must lie {limits}"
        values[at[f"{table.id}.{one.name}"]] = value


def signal_problems(system: System, units: Mapping[str, str]) -> list[str]:
    """Return what is wrong with a model's signals beside those of the data, whose `units` are given by name."""
    found = []
    declared = {one.name: one.unit for one in system.inputs} | {one.name: one.unit for one in system.outputs}
    for name in units:
        if name not in declared:
            found.append(f'the data have a signal "{name}", the model has none{nearest(name, declared)}')
    for one in system.inputs:
        if one.name not in units:
            found.append(
                f'model.inputs.{one.name}: the data have no signal "{one.name}"{nearest(one.name, units)}'
            )
    if not any(one.name in units for one in system.outputs):
        found.append(f"model.outputs: the data have none of {', '.join(one.name for one in system.outputs)}")
    for name, unit in units.items():
        wanted = declared.get(name)
        if wanted is not None and parsed_unit(unit).dimensionality != parsed_unit(wanted).dimensionality:
            found.append(
                f'"{name}" is in {unit} in the data, which is not compatible with {wanted} of the model'
            )
    return found


def free_parameter(one: Constant) -> FreeParameter:
    """Return a parameter as a fit sees it."""
    size = abs(one.value) or (one.high - one.low if np.isfinite(one.high - one.low) else 1.0)
    declared = Parameter(
        name=one.name, unit=one.unit, meaning="", scale=lambda scales: size, low=one.low, high=one.high
    )
    return FreeParameter(one.name, one.unit, one.value, one.low, one.high, one.fixed, declared, "")
