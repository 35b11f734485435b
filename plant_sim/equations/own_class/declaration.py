"""The class of a device to the tables of a model file whose expressions call the functions of the class.

    rates(...)      the rates of the states, in their order; each in the state's unit per second
    readings(...)   the outputs, in their order; without it, outputs that are named as states are these states

Arguments of both are names of states, inputs, parameters, or `t` [s], in any order; their numbers are in the declared
units. The class is never made an object of.
"""

from __future__ import annotations

import inspect
import types
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from plant_sim.equations.language.functions import TIME
from rtctl.border.equations.file import KIND, EquationsFile
from rtctl.border.errors import InputError, nearest
from rtctl.border.importing import import_object, look_beside
from rtctl.border.units.quantities import check

RATES, READINGS = "rates", "readings"
TABLES = ("inputs", "states", "outputs", "parameters")
"""Attributes of a class that are tables of a model file, a unit standing for a table that has nothing else."""
DEVICE = "device"
"""Attribute that is the table [device] of a model file: limits of inputs, noise of outputs."""
FURTHER = ("terms", "events")
"""Tables that a class may have as a model file has them."""


class OwnFunction(NamedTuple):
    """A function of a class, and the names of what it takes and returns."""

    function: Callable[..., Any]
    arguments: tuple[str, ...]
    members: tuple[str, ...]


def content_of(owner: type, *, named: str | None = None) -> EquationsFile:
    """Return a class as the content of a model file. Raises InputError with every finding.

    Args:
        owner: The class.
        named: "module:Class" under which the file names it; None: where Python says that it stands.
    """
    where = named or f"{owner.__module__}:{owner.__qualname__}"
    if "<locals>" in where:
        raise InputError(f"{where}: the class stands inside a function; put it at the top of a module")
    tables = {"model": {"kind": KIND, "python": where, **tables_of(owner, where)}}
    return check(EquationsFile, {**tables, "device": getattr(owner, DEVICE, {})}, where)


def with_class(tables: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return the tables of a file with those of the class that it names; what the file says itself counts.

    Raises:
        InputError: The class does not import, or is none of a device.
    """
    model = tables.get("model")
    if not isinstance(model, dict) or "python" not in model:
        return dict(tables)
    look_beside(path.parent)
    whole = dict(model)
    owner = imported(model["python"], str(path))
    for word, entries in tables_of(owner, model["python"]).items():
        own = model.get(word, {})
        if not isinstance(own, dict):
            continue  # the check of the tables says so
        whole[word] = {name: _joined(one, own[name]) if name in own else one for name, one in entries.items()}
        whole[word] |= {name: one for name, one in own.items() if name not in entries}
    return {"device": getattr(owner, DEVICE, {}), **tables, "model": whole}


def _joined(one: Any, own: Any) -> Any:
    return {**one, **own} if isinstance(one, dict) and isinstance(own, dict) else own


def imported(named: Any, source: str) -> type:
    """Return the class that "module:Class" names. Raises InputError; it names `source`."""
    where = f'{source}: key "model.python"'
    if not isinstance(named, str):
        raise InputError(f'{where}: {named!r} is not "module:Class", such as "my_tank:Tank"')
    found = import_object(named, where)
    if not isinstance(found, type):
        raise InputError(f'{where}: "{named}" is no class, but {found!r}')
    return found


def tables_of(owner: type, where: str) -> dict[str, dict[str, Any]]:
    """Return the tables of a class, with calls of its functions as rates and values. Raises InputError."""
    tables = _declared(owner, where)
    functions = functions_of(owner, where)
    for word, key, name in (("states", "rate", RATES), ("outputs", "value", READINGS)):
        if name not in functions:
            continue
        given = ", ".join(functions[name].arguments)
        for member in functions[name].members:
            tables[word][member] = {key: f"{name}.{member}({given})", **tables[word][member]}
    if READINGS not in functions:
        for name, one in tables["outputs"].items():
            tables["outputs"][name] = {"value": name, **one}
    return tables


@lru_cache(maxsize=64)
def functions_of(owner: type, where: str) -> dict[str, OwnFunction]:
    """Return `rates`, and `readings` where there are some. Raises InputError with every finding."""
    tables = _declared(owner, where)
    known = {TIME, *tables["states"], *tables["inputs"], *tables["parameters"]}
    found: dict[str, OwnFunction] = {}
    lines: list[str] = []
    for name, word in ((RATES, "states"), (READINGS, "outputs")):
        function = _plain(inspect.getattr_static(owner, name, None))
        if function is None:
            if name == RATES:
                lines.append(f"{where}: has no function rates(...), which returns the rates of its states")
            continue
        lines += [f"{where}.{name}: {text}" for text in _argument_findings(function, known)]
        found[name] = OwnFunction(
            function, tuple(inspect.signature(function).parameters), tuple(tables[word])
        )
    if READINGS not in found:
        lines += [
            f"{where}: has no function readings(...), and the output {name} is no state"
            f"{nearest(name, tables['states'])}"
            for name in tables["outputs"]
            if name not in tables["states"]
        ]
    if lines:
        raise InputError("\n".join(lines))
    return found


def _plain(found: Any) -> types.FunctionType | None:
    """Return a function of a class without what decorates it: `staticmethod`, or numba's `njit`."""
    found = getattr(found, "__func__", found)
    found = getattr(found, "py_func", found)
    return found if isinstance(found, types.FunctionType) else None


def _argument_findings(function: types.FunctionType, known: set[str]) -> Iterator[str]:
    for name, one in inspect.signature(function).parameters.items():
        if one.kind is not one.POSITIONAL_OR_KEYWORD or one.default is not one.empty:
            yield f"the argument {name} must be a plain name, without a default, * or /"
        elif name == "self":
            yield 'it takes "self", but it is a plain function of numbers: name what it needs, and leave self out'
        elif name not in known:
            yield f'the argument "{name}" is no state, input or parameter, nor the time t{nearest(name, known)}'


def _declared(owner: type, where: str) -> dict[str, dict[str, Any]]:
    """Return the tables that a class declares, each entry a table. Raises InputError."""
    made: dict[str, dict[str, Any]] = {}
    for word in TABLES + FURTHER:
        declared = getattr(owner, word, {})
        if not isinstance(declared, Mapping):
            raise InputError(f'{where}.{word}: {declared!r} is no table, such as {{"level": "cm"}}')
        made[word] = {
            name: {"unit": one} if isinstance(one, str) and word in TABLES else one
            for name, one in declared.items()
        }
        for name, one in made[word].items():
            if word in TABLES and not isinstance(one, Mapping):
                raise InputError(
                    f'{where}.{word}["{name}"]: {one!r} is neither a unit nor a table with a unit'
                )
    if not made["states"] or not made["outputs"]:
        raise InputError(f"{where}: states and outputs are needed, each a table of names and units")
    return {word: table for word, table in made.items() if table or word in TABLES}
