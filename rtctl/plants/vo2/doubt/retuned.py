"""A VO2 model with what a doubted run has found: causes that began at once, in the places that the loop uses.

A drift (of ambient, of the current's gain, of the film) is none of them: the observer follows heat by itself, and a
model that is fixed at one moment is wrong at the next one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, Value
from rtctl.doubt.naming import Answer
from rtctl.models.vo2 import Vo2Model
from rtctl.plants.vo2.doubt.pure_phases import pure_phases
from rtctl.simulations.vo2.loop_dynamics import loop_dynamics

LAG = "hysteresis.rate_dependence"
PLACES = {
    "actuation.delay": ("delay", "s"),
    "sensor.lag": ("time_constant", "s"),
    LAG: ("time_constant", "s"),
    "thermal.second_time_constant": ("share", "dimensionless"),
    "sensor.crosstalk": ("leak", "ohm/mA"),
}
"""Parameter and unit of each mechanism that takes the size of a cause."""


def retuned_model(model: Vo2Model, causes: Sequence[Answer]) -> Vo2Model:
    """Return a model with causes that have begun since it was identified, one after the other.

    Raises:
        InputError: a cause has no place in estimator and tuning, or its size none in the mechanism.
    """
    made = model
    for cause in causes:
        made = _with(made, cause)
    loop_dynamics(made)  # refuses what is out of a mechanism's range
    return made


def _with(model: Vo2Model, cause: Answer) -> Vo2Model:
    if cause.id == "sensor.gain":
        before = model.corrections.get("resistance_offset")
        offset = math.log1p(cause.size) + (before.value if before is not None else 0.0)
        value = Value(value=offset, unit="dimensionless")
        return replace(model, corrections={**model.corrections, "resistance_offset": value})
    if cause.id not in PLACES:
        raise InputError(
            f"{cause.id} has no place in estimator and tuning that a model of one moment could take"
        )
    name, unit = PLACES[cause.id]
    others = tuple(one for one in model.mechanisms if one.id != cause.id)
    same = [one for one in model.mechanisms if one.id == cause.id]
    size = cause.size + (same[0].parameters[name].to(unit) if same and name in same[0].parameters else 0.0)
    parameters = {**(same[0].parameters if same else {}), name: Value(value=size, unit=unit)}
    if cause.id == LAG and not same:
        phases = pure_phases(model)
        parameters["activation"] = Value(value=phases.activation, unit="1/mA^2")
        parameters["expansion"] = Value(value=phases.expansion, unit="um/mA^2")
    if cause.id == "thermal.second_time_constant":
        parameters["time_constant"] = Value(value=cause.shape, unit="s")
    return replace(model, mechanisms=(*others, MechanismTable(id=cause.id, parameters=parameters)))
