"""What a run is as EPICS process variables: names, units and the values of its newest row.

Set-point, output, estimate, errors, commands, readings and terms have the names of the recording, the gains those of
the controller; a further controlled output NAME has setpoint_NAME, NAME, estimate_NAME and error_NAME.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import plain_unit
from rtctl.live_page.shown.description import Description
from rtctl.loop.live_parameters import SETPOINT

GAINS = "controller."
ERRORS = {"error": "error", "sensing_error": "self_sensing_error"}
"""Names of the computed signals, by role."""
FURTHER = "setpoint_"
"""What the name of the set-point of a further output begins with."""


LONGEST_UNIT = 8
"""Bytes of a unit that Channel Access has room for (its MAX_UNITS_SIZE)."""
_QUOTIENT = re.compile(r"([^()]+)/\(([^()]+)\)")


class Variable(NamedTuple):
    """A process variable that is a number."""

    name: str
    """Behind the prefix."""
    unit: str
    parameter: str = ""
    """Name of the parameter of the run that it sets; "": it can only be read."""


def variables_of(description: Description) -> list[Variable]:
    """Return the numbers of a recording; those of gains and set-point can be set while a run is under way."""
    settable = {} if description.scenario is None else description.parameter_units()
    recorded = {name: plain_unit(unit) for name, unit in description.rows.columns}
    shown = [
        Variable(
            _name(one.role, one.name),
            short_unit(recorded[SETPOINT if one.role in ERRORS else one.name]),
            SETPOINT if one.name == SETPOINT else "",
        )
        for one in description.shown.signals
        if one.role != "band"
    ]
    units = {one.name: one.unit for one in shown}
    errors = [Variable(f"error_{name}", units[f"{FURTHER}{name}"]) for name in _further(units)]
    gains = [
        Variable(one.removeprefix(GAINS), short_unit(plain_unit(unit)), one)
        for one, unit in settable.items()
        if one != SETPOINT
    ]
    return [*shown, *errors, *gains]


def values_of(description: Description, table: Mapping[str, FloatArray]) -> dict[str, float]:
    """Return the values of the last row of `table`, by name of the variable; gains are not among them."""
    column = description.shown.matrix(table)[:, -1].tolist()
    values = {
        _name(one.role, one.name): float(value)
        for one, value in zip(description.shown.signals, column, strict=True)
        if one.role != "band"
    }
    for name in _further(values):
        read = values.get(name, math.nan)
        value = read if math.isfinite(read) else values.get(f"estimate_{name}", math.nan)
        values[f"error_{name}"] = values[f"{FURTHER}{name}"] - value
    return values


def short_unit(unit: str) -> str:
    """Return a unit as Channel Access can carry it, mA/um/s for mA/(um*s); "" where it is longer than there is room."""
    if quotient := _QUOTIENT.fullmatch(unit):
        unit = f"{quotient[1]}/{quotient[2].replace('*', '/')}"
    return unit if unit.isascii() and len(unit) <= LONGEST_UNIT else ""


def _further(names: Mapping[str, object]) -> list[str]:
    """Return the further controlled outputs, by the names of their set-points."""
    return [one.removeprefix(FURTHER) for one in names if one.startswith(FURTHER)]


def _name(role: str, name: str) -> str:
    return ERRORS.get(role, name)
