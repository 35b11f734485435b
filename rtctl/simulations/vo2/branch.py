"""An identified VO2 model on one branch of its major loop, as `rtctl.border.exported.dynamics.Dynamics`.

tau s' = i^2 - s, s [mA^2] the square of the current that holds the present temperature; resistance and deflection are
those that a full cooling and a rise to sqrt(s) leave, or a full heating and a fall to it. So it says how the plant
responds while its temperature goes on as it last went, about any point of that branch; a turn is not in it.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.exported.dynamics import Channel, Dynamics
from rtctl.hysteresis.preisach.model import PreisachModel, preisach_step
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.model import UNITS, vo2_simulation
from rtctl.simulations.vo2.nominal import corrected, middle, middle_reading

BRANCHES = ("rising", "falling")


def vo2_dynamics(model: Vo2Model, source: str, branch: str = "rising") -> Dynamics:
    """Return the plant on a branch, in mA, ohm and um.

    Raises:
        InputError: The branch is none, or a mechanism acts, which is not in these equations.
    """
    if branch not in BRANCHES:
        raise InputError(f'branch = "{branch}" must be one of {", ".join(BRANCHES)}')
    simulation = vo2_simulation(model, UNITS, source)
    if simulation.acting():
        names = ", ".join(one.id for one in simulation.acting())
        raise InputError(f"{source}: {names} is not in the equations of a branch; take the table out")
    values = {one.name: one.value for one in simulation.parameters}

    def rates(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        current = corrected(np.asarray(u, dtype=np.float64), "current", middle(model.current), values)
        return np.asarray((current**2 - x) / values["time_constant"])

    def read(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        v = math.sqrt(max(float(x[0]), 0.0))
        y = np.array([_on_branch(model.resistance_preisach, v, branch)])
        beam = np.array([_on_branch(model.deflection_preisach, v, branch)])
        y = corrected(y, "resistance", middle_reading(model.resistance), values, sign=-1.0)
        beam = corrected(beam, "deflection", middle(model.deflection), values)
        return np.array([math.exp(-float(y[0])), float(beam[0])])

    start = corrected(np.array([model.current.low]), "current", middle(model.current), values) ** 2
    return Dynamics(
        kind="vo2",
        inputs=(Channel(name="current", unit="mA"),),
        states=(Channel(name="surrogate_power", unit="mA^2"),),
        outputs=(Channel(name="resistance", unit="ohm"), Channel(name="deflection", unit="um")),
        initial=start,
        rates=rates,
        read=read,
    )


def _on_branch(loop: PreisachModel, v: float, branch: str) -> float:
    state = loop.initial_state(v if branch == "rising" else float(loop.grid[-1]))
    return float(preisach_step(state, v, loop.params).y)
