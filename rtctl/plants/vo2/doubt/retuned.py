"""A VO2 model with what a doubted run has found: causes that began at once, in the places that the loop uses.

A resistance that drifts is followed from the moment since which the model is right, ever more slowly (`FADES_S`):
nobody knows how long it goes on, and a loop that nobody watches any more must not follow it for ever. Other drifts have
no place: the observer follows heat by itself.
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


AGEING, FADES_S = "sensor.ageing", 300.0
"""A drift of the resistance, and the time after which a model follows it with the logarithm of time [s]."""


def retuned_model(model: Vo2Model, causes: Sequence[Answer], ages_s: Sequence[float] = ()) -> Vo2Model:
    """Return a model with causes that have begun since it was identified, one after the other.

    Args:
        model: The identified model.
        causes: What has changed.
        ages_s: How long each cause had acted [s] when the newest one began; left out: they began with it.

    Raises:
        InputError: a cause has no place in estimator and tuning, or its size none in the mechanism.
    """
    made = model
    for cause, age_s in zip(causes, ages_s or [0.0] * len(causes), strict=True):
        made = _ageing(made, cause, age_s) if cause.id == AGEING else _with(made, cause)
    loop_dynamics(made)  # refuses what is out of a mechanism's range
    return made


def _gained(model: Vo2Model, factor: float) -> Vo2Model:
    """Return a model whose sensor reads the resistance times a factor."""
    before = model.corrections.get("resistance_offset")
    offset = math.log(factor) + (before.value if before is not None else 0.0)
    value = Value(value=offset, unit="dimensionless")
    return replace(model, corrections={**model.corrections, "resistance_offset": value})


def _ageing(model: Vo2Model, cause: Answer, age_s: float) -> Vo2Model:
    """Return a model whose resistance has drifted for some time [s], and goes on."""
    drifted = 1.0 + cause.size * age_s
    if not drifted > 0.0:
        raise InputError(f"{cause.id} of {cause.size:.3g} 1/s leaves no resistance after {age_s:.3g} s")
    parameters = {
        "rate": Value(value=cause.size / drifted, unit="1/s"), "slowing_time": Value(value=FADES_S, unit="s"),
    }  # fmt: skip
    others = tuple(one for one in model.mechanisms if one.id != AGEING)
    made = _gained(model, drifted) if age_s > 0.0 else model
    return replace(made, mechanisms=(*others, MechanismTable(id=AGEING, parameters=parameters)))


def _with(model: Vo2Model, cause: Answer) -> Vo2Model:
    if cause.id == "sensor.gain":
        return _gained(model, 1.0 + cause.size)
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
