"""The model file of an oscillator's fit: its values with errors, and what the fit warns of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from rtctl.border.model_file import MechanismTable, ModelFile, ModelTable, Value
from rtctl.border.simulation import FreeParameter, Simulation
from rtctl.border.statistics import NORMAL_95
from rtctl.identification.fit import Fit
from rtctl.identification.oscillator.response import describe_response
from rtctl.measured.dataset import FREQUENCY
from rtctl.output.readable_units import readable

KIND = "oscillator"
NOMINAL = ("damping", "stiffness", "stiffness_cubic", "drive_gain")
CONSTANT_RESIDUAL_RATIO = 0.7
"""Mean over RMS of a residual above which it is called constant: half of its power."""
Build = Callable[[ModelFile, Mapping[str, str], str], Simulation]
"""Binds a model to the units of the data; the last argument names its file."""


def make_nominal_model(build: Build, units: Mapping[str, str], without: Sequence[str] = ()) -> ModelFile:
    """Return the nominal model with all parameters free but those left out, in the data's units."""
    empty = build(ModelFile(model=ModelTable(kind=KIND)), units, "nominal model")
    return ModelFile(
        model=ModelTable(
            kind=KIND,
            parameters={
                one.name: Value(value=0.0, unit=one.unit)
                for one in empty.parameters
                if one.name in NOMINAL and one.name not in without
            },
        )
    )


def write_model(start: ModelFile, fit: Fit, *, with_errors: bool) -> ModelFile:
    """Return `start` with the fitted values, errors and 95 % intervals, in its own units."""
    numbers = dict(zip(fit.names, zip(fit.values, fit.standard_errors, strict=True), strict=True))
    parameters = {one.name: one for one in fit.simulation.parameters}

    def moved(name: str, old: Value) -> Value:
        if name not in numbers:
            return old
        value, error = numbers[name]
        return _write_value(old, parameters[name], float(value), float(error) if with_errors else np.inf)

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


def _write_value(old: Value, parameter: FreeParameter, value: float, error: float) -> Value:
    """Return a value in the unit of `old`; without errors where the data do not determine it."""
    unit = old.unit
    factor = Value(value=1.0, unit=parameter.unit).to(unit) if unit != parameter.unit else 1.0
    known: dict[str, Any] = {}
    if error < float("inf"):
        half = NORMAL_95 * error
        low, high = max(value - half, parameter.low), min(value + half, parameter.high)
        known = {"low": low * factor, "high": high * factor, "standard_error": error * factor}
    return Value(value=value * factor, unit=unit, **known)


def collect_warnings(fit: Fit, units: Mapping[str, str], *, with_errors: bool) -> tuple[str, ...]:
    """Return what a user must know of a fit: what is undetermined, on a bound, or left as a constant.

    Args:
        fit: The fit.
        units: Units of its outputs.
        with_errors: Whether its values have standard errors.
    """
    said = fit.describe_doubts(with_errors=with_errors)
    if fit.method == "multiple_shooting" and fit.simulation.mechanisms:
        said.append("a mechanism with a memory or a clock of its own began anew with each segment")
    errors = dict(zip(fit.names, fit.standard_errors.tolist(), strict=True)) if with_errors else None
    said += filter(None, [describe_response(fit.simulation, errors)])
    is_swept = FREQUENCY in units  # the parts of a complex amplitude have no zero that could be off
    return tuple(said) if is_swept else (*said, *_describe_offsets(fit, units))


def _describe_offsets(fit: Fit, units: Mapping[str, str]) -> list[str]:
    """Describe residuals that are mostly a constant, which has a simple cause."""
    said = []
    for record, outputs in fit.residuals.items():
        for name, residual in outputs.items():
            mean, rms = float(np.mean(residual)), fit.record_rms[record][name]
            if abs(mean) > CONSTANT_RESIDUAL_RATIO * rms:
                size, side = readable(abs(mean), units[name]), "high" if mean > 0.0 else "low"
                said.append(
                    f"record {record}: {name} is simulated {size} too {side} on average, "
                    f"{100.0 * (mean / rms) ** 2:.0f} % of its residual's power: a start model (--model) with "
                    "sensor.offset or drive.offset would take that"
                )
    return said
