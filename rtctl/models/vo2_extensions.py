"""Extensions of an identified VO2 model in its file: corrections of its signals, and mechanisms by their ids.

Corrections are parameters below [model.parameters] that only a refit writes; `rtctl.simulations.vo2.nominal` defines
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, Value
from rtctl.border.units.quantities import check

CORRECTION_UNITS = {
    "current_gain": "dimensionless",
    "current_offset": "mA",
    "resistance_gain": "dimensionless",
    "resistance_offset": "dimensionless",
    "deflection_gain": "dimensionless",
    "deflection_offset": "um",
}


def corrections_of(parameters: Mapping[str, Any]) -> dict[str, Value]:
    """Return the corrections in the file. Raises InputError that names the key."""
    found = {}
    for name, unit in CORRECTION_UNITS.items():
        if name not in parameters:
            continue
        where = f"model.parameters.{name}"
        if not isinstance(parameters[name], dict):
            raise InputError(f'key "{where}" must be {{ value = <number>, unit = "{unit}" }}')
        found[name] = check(Value, parameters[name], where)
        try:
            found[name].to(unit)
        except ValueError as error:
            raise InputError(f'key "{where}": {error}') from None
    return found


def mechanisms_of(model: Mapping[str, Any]) -> tuple[MechanismTable, ...]:
    """Return [[model.mechanisms]]; the simulation defines which ids exist. Raises InputError that names the key."""
    tables = model.get("mechanisms", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise InputError('key "model.mechanisms" must be a list of tables: write [[model.mechanisms]]')
    found = tuple(check(MechanismTable, table, f"model.mechanisms.{k}") for k, table in enumerate(tables))
    ids = [mechanism.id for mechanism in found]
    twice = sorted({one for one in ids if ids.count(one) > 1})
    if twice:
        raise InputError(f"mechanism {', '.join(twice)} is there twice; keep one of each")
    return found


def extension_tables(
    corrections: Mapping[str, Value], mechanisms: tuple[MechanismTable, ...]
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return parameters and mechanisms as TOML tables; empty for a nominal model."""
    parameters = {
        name: value.model_dump(exclude_none=True, exclude_defaults=True)
        for name, value in corrections.items()
    }
    return parameters, [one.model_dump(exclude_none=True, exclude_defaults=True) for one in mechanisms]
