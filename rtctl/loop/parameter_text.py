"""A change as a person writes it, `setpoint=30 um`, in the units of the run that it is for."""

from __future__ import annotations

import math
from pathlib import Path

from rtctl.border.errors import InputError, nearest
from rtctl.border.quantities import parse_quantity
from rtctl.loop.live_parameters import SETPOINT, Change
from rtctl.recording.layout import read_header
from rtctl.scenario.schema import checked_scenario
from rtctl.session.run_folder import SIGNALS, scenario_tables

GAIN_UNITS = {"controller.kp": "mA/um", "controller.ki": "mA/(um*s)"}
PLAN = "plan"


def read_change(folder: Path, text: str) -> Change:
    """The change; a number without a unit is in that of the parameter. Raises InputError."""
    name, equals, written = (part.strip() for part in text.partition("="))
    if not equals or not written:
        raise InputError(f"{text}: expected NAME=VALUE, such as setpoint=30")
    if name == SETPOINT and written == PLAN:
        return Change(name, math.nan)
    path = folder / SIGNALS
    if not path.is_file():
        raise InputError(f"{folder}: no run is under way here ({SIGNALS} is missing)")
    header = read_header(path)
    scenario = checked_scenario(scenario_tables(header.metadata, path), str(path))
    units = {SETPOINT: scenario.profile.reference.unit, **GAIN_UNITS}
    if name not in units:
        raise InputError(f'"{name}" cannot be changed while the loop runs{nearest(name, units)}')
    try:
        value = float(written)
    except ValueError:
        try:
            value = parse_quantity(written, units[name])
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None
    if not math.isfinite(value):
        raise InputError(f"{name} = {written}: a finite number is needed")
    return Change(name, value)
