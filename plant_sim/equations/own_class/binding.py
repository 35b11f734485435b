"""Calls in expressions bound to the compiled functions of the class that a model file names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from plant_sim.equations.compiled.kernels import compiled_at_many
from plant_sim.equations.language.block import Block
from plant_sim.equations.language.functions import TIME
from plant_sim.equations.language.tree import Own, Tree, rebuilt
from plant_sim.equations.own_class.declaration import RATES, OwnFunction, functions_of, imported
from rtctl.border.equations.file import EquationsTable
from rtctl.border.errors import nearest
from rtctl.border.units.quantities import unit_registry
from rtctl.border.units.unit_text import parsed_unit


def blocks_of(model: EquationsTable, source: str) -> dict[str, Block]:
    """Return the compiled functions of a model by name; none where it names no class.

    Raises:
        InputError: The class does not import, or is none of a device; it names `source`.
        ValueError: A function cannot be compiled, or a unit of it is none.
    """
    if not model.python:
        return {}
    functions = functions_of(imported(model.python, source), model.python)
    return {name: _block(name, one, model) for name, one in functions.items()}


def bound(tree: Tree, blocks: Mapping[str, Block]) -> Tree:
    """Return a tree whose calls know their functions. Raises ValueError for a call of what there is not."""
    return rebuilt(tree, lambda one: _bound_call(one, blocks) if isinstance(one, Own) else one)


def _bound_call(one: Own, blocks: Mapping[str, Block]) -> Own:
    block = blocks.get(one.function)
    if block is None:
        if not blocks:
            raise ValueError(f"{one.function}.{one.member}: the model names no class (model.python)")
        raise ValueError(f'the class has no function "{one.function}"{nearest(one.function, blocks)}')
    if one.member not in block.members:
        raise ValueError(f'{one.function} returns no "{one.member}"{nearest(one.member, block.members)}')
    if len(one.arguments) != len(block.arguments):
        raise ValueError(
            f"{one.function} takes {len(block.arguments)} arguments ({', '.join(block.arguments)}), got "
            f"{len(one.arguments)}"
        )
    return replace(one, block=block)


def _block(name: str, own: OwnFunction, model: EquationsTable) -> Block:
    units = {TIME: "s"} | {
        key: one.unit
        for table in (model.states, model.inputs, model.parameters)
        for key, one in table.items()
    }
    of_members = model.states if name == RATES else model.outputs
    member_units = [of_members[one].unit for one in own.members]
    symbol, many = compiled_at_many(own.function, own.arguments, own.members, f"{model.python}.{name}")
    many(np.ones((max(len(own.arguments), 1), 1)))  # what does not compile is said now, not at the first step
    return Block(
        symbol=symbol,
        members=own.members,
        member_units=tuple(f"({unit})/s" if name == RATES else unit for unit in member_units),
        member_factors=tuple(_factor(unit) for unit in member_units),
        arguments=own.arguments,
        argument_units=tuple(units[one] for one in own.arguments),
        argument_factors=tuple(_factor(units[one]) for one in own.arguments),
        many=many,
    )


def _factor(unit: str) -> float:
    return float(unit_registry().Quantity(1.0, parsed_unit(unit)).to_base_units().magnitude)
