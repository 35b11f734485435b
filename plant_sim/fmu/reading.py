"""A functional mock-up unit as a model: of a model file that names one, or the unit itself with all its parameters."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from plant_sim.equations.reading import factor_of
from plant_sim.fmu.unit import SCALARS, Unit, read_unit, unit_text
from rtctl.border.equations.fmu_file import KIND, FmuFile, FmuTable, StartTable
from rtctl.border.errors import InputError, nearest
from rtctl.border.model_file import Value
from rtctl.border.units.quantities import check, read_toml
from rtctl.border.units.unit_text import parsed_unit

SUFFIX = ".fmu"
STEP_LENGTH = "longest_step"
"""Parameter of units that rtctl writes: the longest step of their integrator, nothing of the device."""


def read_fmu_model(path: Path) -> FmuFile:
    """Return the model of a file or of a unit.

    Raises:
        InputError: The file, or the unit that it names, is not what it should be; all findings at once.
    """
    if path.suffix.lower() == SUFFIX:
        return whole_unit(read_unit(path))
    content = check(FmuFile, read_toml(path), str(path))
    unit = read_unit(path.parent / content.model.file)
    findings = list(_findings(content, unit))
    if findings:
        raise InputError("\n".join(f"{path}: {one}" for one in findings))
    table = content.model.model_copy(update={"file": str(unit.path.resolve())})
    return content.model_copy(update={"model": table})


def whole_unit(unit: Unit) -> FmuFile:
    """Return the model of a unit: all parameters that are real numbers are free, within the unit's own bounds.

    Those of units of rtctl's own that are values of states at the start are such there.
    """
    parameters, states = {}, {}
    own = str(unit.description.generationTool or "").startswith("rtctl")
    for one in parameters_of(unit):
        text, value = unit_text(one, unit.description) or "", float(one.start)
        name = one.name.removesuffix("_start")
        if own and one.name == STEP_LENGTH:
            continue
        if own and name != one.name and one.variability == "fixed":
            states[name] = StartTable(
                start=one.name, unit=text, variable=_variable(unit, name), initial=value
            )
            continue
        low, high = (None if bound is None else float(bound) for bound in (one.min, one.max))
        parameters[one.name] = Value(value=value, unit=text, low=low, high=high)
    table = FmuTable(kind=KIND, file=str(unit.path.resolve()), parameters=parameters, states=states)
    return FmuFile(model=table)


def ratio(unit: str, other: str) -> float:
    """Return how many of the `other` unit one `unit` is; 1 where they are the same, whatever their zero means.

    Raises:
        ValueError: One of two different units has its zero elsewhere, as degC has.
    """
    return 1.0 if unit == other else factor_of(unit) / factor_of(other)


def parameters_of(unit: Unit) -> list[Any]:
    """Return the parameters of a unit that are single real numbers with a value."""
    return [
        one
        for one in unit.description.modelVariables
        if one.causality == "parameter"
        and one.type in SCALARS
        and not getattr(one, "dimensions", None)
        and one.start not in (None, "")
    ]


def _variable(unit: Unit, name: str) -> str:
    """Return the variable of a unit of rtctl's own that is a state while it runs; "": there is none."""
    known = [one.name for one in unit.description.modelVariables if one.causality in ("local", "output")]
    return next((one for one in (f"state.{name}", name) if one in known), "")


def _findings(content: FmuFile, unit: Unit) -> Iterator[str]:
    known = {one.name: one for one in parameters_of(unit)}
    asked = {f"model.parameters.{name}": (name, one.unit) for name, one in content.model.parameters.items()}
    asked |= {
        f"model.states.{name}.start": (one.start, one.unit) for name, one in content.model.states.items()
    }
    for key, (name, unit_here) in asked.items():
        if name not in known:
            yield f'{key}: the unit has no parameter "{name}" that is a real number{nearest(name, known)}'
            continue
        there = unit_text(known[name], unit.description) or ""
        try:
            fits = parsed_unit(unit_here).dimensionality == parsed_unit(there).dimensionality
        except ValueError as error:
            yield f"{key}: {error}"
            continue
        if not fits:
            yield f"{key} is in {unit_here}, which is not compatible with {there or '1'} of the unit"
    variables = [one.name for one in unit.description.modelVariables if one.type in SCALARS]
    for name, state in content.model.states.items():
        if state.variable and state.variable not in variables:
            yield (
                f'model.states.{name}.variable: the unit has no variable "{state.variable}" that is a real number'
                f"{nearest(state.variable, variables)}"
            )
