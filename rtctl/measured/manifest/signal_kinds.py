"""Which signals a kind of plant has, and in which unit they are held, asked from the registry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rtctl.border.errors import nearest
from rtctl.border.motion import held_response, lowest_response, with_displacement
from rtctl.measured.units import check_is_no, check_proportional, check_unit, is_unit
from rtctl.registry import PlantKind, SignalKind, plant_kind, plant_kinds


def measured_kinds() -> dict[str, PlantKind]:
    """Return the kinds of plant that have datasets, by name."""
    return {name: kind for name, kind in plant_kinds().items() if kind.has_datasets}


def held_unit(plant: str, signal: str, units: Mapping[str, Any]) -> str:
    """Return the unit in which `signal` is held; `units` are the manifest's."""
    kind = plant_kind(plant).signal(signal, "")
    if kind is None:
        raise ValueError(f'a plant "{plant}" has no signal "{signal}"')
    if kind.derivative_of is not None and signal == lowest_response(units):
        return held_response(signal, str(units[signal]))
    if kind.derivative_of is None:
        return kind.unit or str(units[signal])
    return f"{with_displacement(units)[kind.derivative_of]}/s" + ("^2" if kind.derivatives == 2 else "")


def held_name(plant: str, signal: str) -> str:
    """Return the name under which `signal` is held: its own, or that of the signal for which it stands."""
    kind = plant_kind(plant).signal(signal, "")
    return (kind.stands_for if kind else "") or signal


def signal_findings(plant: str, signals: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with the names, roles and units of the `[signals]` tables, as read from the file."""
    if plant_kind(plant).free_signals:
        return _free_findings(plant, signals)
    kinds = plant_kind(plant).signals
    found = [
        f'unknown signal "signals.{name}" of a plant "{plant}"{nearest(name, kinds)}'
        for name in signals
        if name not in kinds
    ]
    for name, kind in kinds.items():
        standing = [other for other, one in kinds.items() if one.stands_for == name and other in signals]
        if name in signals:
            found += _table_findings(plant, name, kind, signals)
            found += [
                f'signals "{name}" and "{other}" are both there: a plant "{plant}" has one input; remove one, or write '
                "its equations with both"
                for other in standing
            ]
        elif not (kind.optional or kind.stands_for or standing):
            unit = f" in {kind.unit}" if kind.unit else ""
            released = kind.role == "input" and plant_kind(plant).may_be_released
            none = "; where nothing drives, with constant = 0.0" if released else ""
            found.append(
                f'signal "{name}" is missing: a plant "{plant}" needs its {kind.role}; '
                f'add [signals.{name}] with role = "{kind.role}" and its unit{unit}{none}'
            )
    responses = plant_kind(plant).responses
    if responses and not set(responses) & signals.keys():
        found.append(
            f'no response is there: a plant "{plant}" needs one of {", ".join(responses)}; '
            f'add [signals.{responses[0]}] with role = "output" and its unit'
        )
    return found


def _free_findings(plant: str, signals: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with signals that a user's model names: no output, and units."""
    roles = {name: table.get("role") for name, table in signals.items() if isinstance(table, dict)}
    found = []
    if "output" not in roles.values():
        found.append(
            f'no output is there: a plant "{plant}" needs one; add [signals.<name>] with role = "output", the name as '
            "in the model, and its unit"
        )
    for name, role in roles.items():
        found += _table_findings(plant, name, SignalKind(role=str(role)), signals)
    return found


def _table_findings(plant: str, name: str, kind: SignalKind, signals: Mapping[str, Any]) -> list[str]:
    table = signals[name] if isinstance(signals[name], dict) else {}
    found = []
    role, unit = table.get("role"), table.get("unit")
    if role in ("input", "output") and role != kind.role:
        found.append(f'key "signals.{name}.role": "{name}" of a plant "{plant}" is its {kind.role}')
    if isinstance(unit, str):
        units = {key: value.get("unit") for key, value in signals.items() if isinstance(value, dict)}
        try:
            check_unit(unit)
            check_unit(unit, held_unit(plant, name, {key: one for key, one in units.items() if is_unit(one)}))
            if kind.unit is None:
                check_proportional(unit)
                check_is_no(unit, kind.not_in)
                check_unit(unit, kind.like or None)
        except ValueError as error:
            found.append(f'key "signals.{name}.unit": {error}')
    return found
