"""Temperatures of data and of a model of equations: readings in degrees Celsius that are said to be in K."""

from __future__ import annotations

import numpy as np

from rtctl.border.equations.file import EquationsFile
from rtctl.measured.dataset import Dataset
from rtctl.measured.units import check_unit, convert_column

PLAIN_C = (-60.0, 150.0)
"""Range [degC] of what instruments read in a laboratory."""
WARM_K = 200.0
"""Temperature [K] above which a model's states are absolute ones of such a laboratory."""
CELSIUS = (
    "{} is said to be in K and lies between {:.3g} and {:.3g}, as degrees Celsius do, while the model's {} begins at "
    '{:.4g} K: if the column is in degC, write offset = 273.15 beside unit = "K" in [signals.{}]'
)


def describe_celsius(model: EquationsFile, dataset: Dataset) -> tuple[str, ...]:
    """Return a remark on each output in K whose readings look like degrees Celsius beside the model's states."""
    warm = [
        (name, state.initial)
        for name, state in model.model.states.items()
        if _is_temperature(state.unit) and _in_kelvin(state.initial, state.unit) > WARM_K
    ]
    found = []
    for name in model.model.outputs if warm else ():
        parts = [one.signals[name] for one in dataset.records if one.has(name)]
        if not parts or not _is_temperature(dataset.units[name]):
            continue
        low = _in_kelvin(float(min(part.min() for part in parts)), dataset.units[name])
        high = _in_kelvin(float(max(part.max() for part in parts)), dataset.units[name])
        if PLAIN_C[0] <= low and high <= PLAIN_C[1]:
            state, start = warm[0]
            found.append(CELSIUS.format(name, low, high, state, start, name))
    return tuple(found)


def _is_temperature(unit: str) -> bool:
    try:
        check_unit(unit, "K")
    except ValueError:
        return False
    return True


def _in_kelvin(value: float, unit: str) -> float:
    return float(convert_column(np.array([value]), unit, "K")[0])
