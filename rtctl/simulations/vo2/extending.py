"""Write a simulation's numbers back into the model of its file."""

from __future__ import annotations

from dataclasses import replace

from rtctl.border.model_file import MechanismTable, Value
from rtctl.border.simulation import FreeParameter
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.nominal import CORRECTIONS, TIME_CONSTANT
from rtctl.simulations.vo2.simulation import Vo2Simulation

Interval = tuple[float, float]


def extended_model(simulation: Vo2Simulation, intervals: dict[str, Interval] | None = None) -> Vo2Model:
    """Return the identified model with the simulation's values and mechanisms; `intervals` by a parameter's name.

    Neutral values are left out of the corrections; a time constant that did not move keeps its standard error.
    """
    nominal = {one.name: one for one in simulation.parameters if not one.mechanism}
    corrections = {
        name: _value(nominal[name], intervals)
        for name, declared in CORRECTIONS.items()
        if nominal[name].value != declared.default
    }
    mechanisms = tuple(
        MechanismTable(
            id=mechanism.id,
            parameters={
                one.declared.name: _value(one, intervals)
                for one in simulation.parameters
                if one.mechanism == mechanism.id
            },
        )
        for mechanism in simulation.mechanisms
    )
    return replace(
        simulation.model,
        time_constant_s=nominal[TIME_CONSTANT.name].value,
        corrections=corrections,
        mechanisms=mechanisms,
    )


def _value(one: FreeParameter, intervals: dict[str, Interval] | None) -> Value:
    low, high = (intervals or {}).get(one.name, (None, None))
    return Value(value=one.value, unit=one.unit, fixed=one.fixed, low=low, high=high)
