"""An oscillator's dataset to its model: weak-form starts, output error or multiple shooting, values with intervals."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, ModelFile, ModelTable, Value
from rtctl.border.simulation import FreeParameter, Simulation
from rtctl.identification.fit import Fit
from rtctl.identification.fit_record import FitRecord, fit_records
from rtctl.identification.output_error import FitOptions, Told, fit_output_error
from rtctl.identification.start_values import start_values
from rtctl.identification.weak_form import WeakFit
from rtctl.measured.dataset import Dataset

KIND = "oscillator"
NOMINAL = ("damping", "stiffness", "stiffness_cubic", "drive_gain")
CONFIDENCE_95 = 1.96
Build = Callable[[ModelFile, Mapping[str, str], str], Simulation]


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorFitOptions:
    """What a user may choose."""

    starts: int = 6
    seed: int = 0
    fit: FitOptions = field(default_factory=FitOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class OscillatorFit:
    """A model file, and how it came about."""

    model: ModelFile
    """Without provenance."""
    fit: Fit
    weak: WeakFit
    reason: str
    """Why this method."""
    warnings: tuple[str, ...]
    records: tuple[FitRecord, ...]
    """That were fitted."""


def identify_oscillator(
    dataset: Dataset,
    model: ModelFile | None,
    build: Build,
    options: OscillatorFitOptions | None = None,
    *,
    source: str = "model",
    told: Told = lambda text, share: None,
) -> OscillatorFit:
    """Fit the parameters of `model` that are not fixed; without one the nominal four.

    `build` binds a model to units (`rtctl.wiring.build_simulation`). Raises InputError where there is nothing to fit,
    FitError where no start leads anywhere.
    """
    options = options or OscillatorFitOptions()
    records = _usable_records(dataset)
    start = model or _nominal(build, dataset.units)
    simulation = build(start, dataset.units, source)
    if all(parameter.fixed for parameter in simulation.parameters):
        raise InputError(f"{source}: every parameter is fixed or missing: there is nothing to fit")
    told("start values", 0.0)
    starts = start_values(simulation, records, options.starts, options.seed, trust_own=model is not None)
    fit = fit_output_error(simulation, records, options.fit, starts=starts.values, told=told)
    reason = "free runs follow the data"
    return OscillatorFit(
        model=_written(start, fit),
        fit=fit,
        weak=starts.weak,
        reason=reason,
        warnings=_warnings(fit),
        records=records,
    )


def _usable_records(dataset: Dataset) -> tuple[FitRecord, ...]:
    if dataset.plant != KIND:
        raise InputError(
            f'{dataset.path}: key "dataset.plant" is "{dataset.plant}", --kind {KIND} needs "{KIND}"'
        )
    records = fit_records(dataset)
    if not records:
        raise InputError(f'{dataset.path}: no record has use = "fit"; test records are never fitted')
    for record in records:
        if not any(values[record.first :].any() for values in record.measured.values()):
            raise InputError(f"{dataset.path}: record {record.name}: nothing moves, all outputs are zero")
    return records


def _nominal(build: Build, units: Mapping[str, str]) -> ModelFile:
    """The nominal model with everything free, in the data's units."""
    empty = build(ModelFile(model=ModelTable(kind=KIND)), units, "nominal model")
    return ModelFile(
        model=ModelTable(
            kind=KIND,
            parameters={
                one.name: Value(value=0.0, unit=_plain(one.unit))
                for one in empty.parameters
                if one.name in NOMINAL
            },
        )
    )


def _plain(unit: str) -> str:
    """A unit without brackets around single names: 1/((V)^2*s^2) is 1/(V^2*s^2)."""
    while (shorter := re.sub(r"\((\w+)\)", r"\1", unit)) != unit:
        unit = shorter
    return unit


def _written(start: ModelFile, fit: Fit) -> ModelFile:
    """`start` with the fitted values, errors and 95 % intervals, in its own units."""
    numbers = dict(zip(fit.names, zip(fit.values, fit.standard_errors, strict=True), strict=True))
    parameters = {one.name: one for one in fit.simulation.parameters}

    def moved(name: str, old: Value) -> Value:
        if name not in numbers:
            return old
        value, error = numbers[name]
        return _value(old, parameters[name], float(value), float(error))

    return ModelFile(
        model=ModelTable(
            kind=KIND,
            parameters={name: moved(name, old) for name, old in start.model.parameters.items()},
            mechanisms=tuple(
                MechanismTable(
                    id=table.id,
                    parameters={
                        name: moved(f"{table.id}.{name}", old) for name, old in table.parameters.items()
                    },
                )
                for table in start.model.mechanisms
            ),
        )
    )


def _value(old: Value, parameter: FreeParameter, value: float, error: float) -> Value:
    """In the unit of `old`; without errors where the data say nothing."""
    unit = old.unit
    factor = Value(value=1.0, unit=parameter.unit).to(unit) if unit != parameter.unit else 1.0
    known: dict[str, Any] = {}
    if error < float("inf"):
        half = CONFIDENCE_95 * error
        low, high = max(value - half, parameter.low), min(value + half, parameter.high)
        known = {"low": low * factor, "high": high * factor, "standard_error": error * factor}
    return Value(value=value * factor, unit=unit, **known)


def _warnings(fit: Fit) -> tuple[str, ...]:
    said = list(fit.determinability.sentences())
    if fit.status != "converged":
        said.append(f"the fit {fit.status}" if fit.status.startswith("stopped") else str(fit.status))
    for k, name in zip(fit.free, fit.names, strict=True):
        parameter = fit.simulation.parameters[k]
        if parameter.value in (parameter.low, parameter.high):
            said.append(
                f"{name} ended on its bound, {parameter.value:g} {parameter.unit}: the model is short of something"
            )
    return tuple(said)
