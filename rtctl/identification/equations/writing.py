"""A fitted model as a file: values with standard errors in the file's own units, bounds as they were, the start."""

from __future__ import annotations

from typing import Any

from rtctl.border.equations.fmu_file import UserModel
from rtctl.border.model_file import Value
from rtctl.identification.fit import Fit


def write_fitted(start: UserModel, fit: Fit, *, with_errors: bool) -> UserModel:
    """Return `start` with the fitted values, and the fitted start of the first record as `initial`."""
    errors = dict(zip(fit.names, fit.standard_errors.tolist(), strict=True))
    values = {one.name: one.value for one in fit.simulation.parameters}
    parameters = {
        name: _moved(old, values[name], errors[name] if with_errors else float("inf"))
        if name in errors
        else old
        for name, old in start.model.parameters.items()
    }
    first = dict(zip(fit.simulation.state, fit.initial[0].tolist(), strict=True)) if len(fit.initial) else {}
    states: dict[str, Any] = dict(start.model.states)
    for name, value in first.items():
        states[name] = states[name].starting_at(value)
    model = start.model.model_copy(update={"parameters": parameters, "states": states})
    written: UserModel = start.model_copy(update={"model": model, "provenance": {}})
    return written


def _moved(old: Value, value: float, error: float) -> Value:
    """Return a value with its standard error; without one where the data do not determine it."""
    known = {"standard_error": error} if error < float("inf") else {}
    return Value(value=value, unit=old.unit, low=old.low, high=old.high, **known)
