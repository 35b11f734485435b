"""Numbers of a VO2 model as its stepping functions take them: parameters, which may change, and constants."""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Mapping
from typing import Any, NamedTuple

from rtctl.hysteresis.preisach.model import PreisachParams
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.mechanism import Vo2Mechanism
from rtctl.simulations.vo2.mechanisms import MECHANISMS
from rtctl.simulations.vo2.nominal import NOMINAL_PARAMETERS, middle, middle_reading

Parameters = Any
"""A NamedTuple of NamedTuples: `nominal`, and one for each mechanism, by the last word of its id."""


class Constants(NamedTuple):
    """Numbers of the identified model that stay."""

    resistance: PreisachParams
    """Read-out of -ln R, R in ohm."""
    deflection: PreisachParams
    """Read-out of the deflection [um]."""
    cold: float
    """-ln of the cold film's resistance [ohm]."""
    metal: float
    """-ln of the metallic film's resistance [ohm]."""
    low: float
    """Lowest current at identification [mA]."""
    high: float
    """Highest current at identification [mA]."""
    current_middle: float
    """About which the gain of the current turns [mA]."""
    reading_middle: float
    """About which the gain of -ln R turns."""
    deflection_middle: float
    """About which the gain of the deflection turns [um]."""
    between: bool
    """Whether readings are taken between communication points too: some mechanism needs them."""
    creeps: bool
    """Whether the transition creeps: its relaxations are followed, also while its rate is 0."""


def constants_of(model: Vo2Model, *, between: bool, creeps: bool) -> Constants:
    """Return the constants of a model."""
    return Constants(
        resistance=model.resistance_preisach.params, deflection=model.deflection_preisach.params,
        cold=-math.log(model.resistance.high), metal=-math.log(model.resistance.low),
        low=model.current.low, high=model.current.high, current_middle=middle(model.current),
        reading_middle=middle_reading(model.resistance), deflection_middle=middle(model.deflection), between=between,
        creeps=creeps,
    )  # fmt: skip


def group_of(identity: str) -> str:
    """Return the name of a mechanism's numbers among the parameters: the last word of its id."""
    return identity.rpartition(".")[2]


def _type(name: str, fields: list[str]) -> Any:
    return namedtuple(name.title().replace("_", ""), fields)


def _full_names() -> dict[str, dict[str, str]]:
    """Return by group and field the name of a parameter as `Vo2Simulation` has it."""
    found = {"nominal": {one.name: one.name for one in NOMINAL_PARAMETERS}}
    for identity, mechanism in MECHANISMS.items():
        found[group_of(identity)] = {one.name: f"{identity}.{one.name}" for one in mechanism.parameters}
    return found


FULL_NAMES = _full_names()
TYPES = {group: _type(group, list(fields)) for group, fields in FULL_NAMES.items()}
WHOLE = _type("parameters", list(TYPES))


def parameters_of(values: Mapping[str, float]) -> Parameters:
    """Return the parameters with some values, by full name; mechanisms that are not in it are neutral."""
    neutral = neutral_values()
    return WHOLE(
        **{
            group: TYPES[group](**{field: values.get(full, neutral[full]) for field, full in fields.items()})
            for group, fields in FULL_NAMES.items()
        }
    )


def neutral_values() -> dict[str, float]:
    """Return by full name what each parameter is where its mechanism has no effect."""
    found = {one.name: float(one.default or 0.0) for one in NOMINAL_PARAMETERS}
    for identity, mechanism in MECHANISMS.items():
        found |= {f"{identity}.{name}": value for name, value in _neutral(mechanism).items()}
    return found


def _neutral(mechanism: Vo2Mechanism) -> dict[str, float]:
    pairs = ((one.name, (one.neutral, one.default)) for one in mechanism.parameters)
    return {name: next((x for x in known if x is not None), 1.0) for name, known in pairs}
