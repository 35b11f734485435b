"""The state in which a record begins, as the manifest has it: `initial` of a `[[records]]` table."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.border.errors import nearest
from rtctl.border.units.quantities import parse_quantity
from rtctl.border.units.unit_text import parse_base_quantity
from rtctl.measured.manifest.findings import Findings
from rtctl.measured.manifest.schema import Manifest, RecordTable
from rtctl.measured.manifest.signal_kinds import held_unit
from rtctl.registry import plant_kind


def read_initial_state(
    manifest: Manifest, entry: RecordTable, where: str, findings: Findings
) -> dict[str, float]:
    """Return `initial` in held units: a quantity, or a number in the unit that the manifest gives the signal."""
    plant = manifest.dataset.plant
    if plant_kind(plant).free_signals:
        return _of_named_states(entry, where, findings)
    known = plant_kind(plant).initial
    units = {name: table.unit for name, table in manifest.signals.items()}
    state: dict[str, float] = {}
    for key, raw in entry.initial.items():
        if key not in known:
            findings.add(
                f'{where}: unknown key "initial.{key}" of a plant "{plant}"'
                f"{nearest(key, known) or '; it starts on the branch that a full cooling leaves'}"
            )
            continue
        with findings.under(f"{where}, key initial.{key}"):
            state[key] = _value(raw, held_unit(plant, key, units), units.get(key))
    return state


def _of_named_states(entry: RecordTable, where: str, findings: Findings) -> dict[str, float]:
    """Return `initial` of states that a user's model names, each a quantity such as "3 cm", in SI base units."""
    state: dict[str, float] = {}
    for key, raw in entry.initial.items():
        with findings.under(f"{where}, key initial.{key}"):
            state[key] = parse_base_quantity(raw)
    return state


def _value(raw: Any, held: str, written: str | None) -> float:
    if isinstance(raw, int | float) and not isinstance(raw, bool):
        raw = {"value": raw, "unit": written or held}
    value = parse_quantity(raw, held)
    if not np.isfinite(value):
        raise ValueError(f"must be finite, got {value!r} {held}")
    return value
