"""The extended model as a file: fitted values with 95 % intervals, mechanisms, where it comes from."""

from __future__ import annotations

from typing import Any

from rtctl.border.model_file import MechanismTable, ModelFile, ModelTable, Value
from rtctl.diagnosis.answer import Estimate, estimates_of
from rtctl.diagnosis.gate import Examined


def extended_model(start: ModelFile, examined: Examined, provenance: dict[str, Any]) -> ModelFile:
    """`start` with the values and mechanisms of `examined`; a parameter that was not fitted stays as it was."""
    nominal = estimates_of(examined, "")
    parameters = {
        name: _value(nominal[name]) if name in nominal else value
        for name, value in start.model.parameters.items()
    }
    tables = {table.id: table for table in start.model.mechanisms}
    for mechanism in examined.hypothesis.simulation.mechanisms:
        estimates = estimates_of(examined, mechanism.id)
        kept = tables[mechanism.id].parameters if mechanism.id in tables else {}
        values = kept | {name: _value(estimate) for name, estimate in estimates.items()}
        tables[mechanism.id] = MechanismTable(id=mechanism.id, parameters=values)
    return ModelFile(
        model=ModelTable(kind=start.kind, parameters=parameters, mechanisms=tuple(tables.values())),
        provenance=provenance,
    )


def _value(estimate: Estimate) -> Value:
    return Value(value=estimate.value, unit=estimate.unit, low=estimate.low, high=estimate.high)
