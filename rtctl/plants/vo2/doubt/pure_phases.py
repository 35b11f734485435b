"""What semiconductor and metal do by themselves, by the identified loops: it does not lag where the transition does.

At the cold end of the heating branch nothing switches yet: there the semiconductor alone conducts better with
temperature, and the beam bends by its expansion alone. A range that begins within the transition gives too much of
both, by what switches there.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from rtctl.hysteresis.preisach.model import PreisachModel, preisach_step
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics

COLD_END = 0.1
"""Of the range of heat at identification: its cold end."""


class PurePhases(NamedTuple):
    """Shapes of `hysteresis.rate_dependence`."""

    activation: float
    """By which the semiconductor's -ln R grows with heat [1/mA^2]."""
    expansion: float
    """By which the beam bends back with heat [um/mA^2]."""


def pure_phases(model: Vo2Model) -> PurePhases:
    """Return what a model's loops say of its pure phases."""
    low, high = model.current.low**2, model.current.high**2
    end = low + COLD_END * (high - low)
    rise = (_at(model.resistance_preisach, end) - _at(model.resistance_preisach, low)) / (end - low)
    bend = (_at(model.deflection_preisach, end) - _at(model.deflection_preisach, low)) / (end - low)
    return PurePhases(max(rise, 0.0), -bend)


def lagging(own: Vo2Dynamics, time_constant_s: float, phases: PurePhases) -> Vo2Dynamics:
    """Return dynamics whose transition lags by `time_constant_s` [s] more; one that lags already keeps its phases."""
    late = own.balance._replace(lag_s=own.balance.lag_s + time_constant_s)
    if own.balance.lag_s != 0.0:
        return replace(own, balance=late)
    film = own.phases._replace(activation=phases.activation)
    return replace(own, balance=late, phases=film, expansion=phases.expansion)


def _at(loop: PreisachModel, power: float) -> float:
    """Return a read-out at a heat [mA^2] on the heating branch."""
    v = math.sqrt(power)
    return float(preisach_step(loop.initial_state(v), v, loop.params).y)
