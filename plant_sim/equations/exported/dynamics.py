"""A model of one's own equations as `rtctl.border.exported.dynamics.Dynamics`: its file's units in and out."""

from __future__ import annotations

import numpy as np

from plant_sim.equations.exported.extended import extended_system
from plant_sim.equations.integration.steps import Places, outputs_at, rates_at
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError
from rtctl.border.exported.dynamics import Channel, Dynamics


def equations_dynamics(model: EquationsFile, source: str) -> Dynamics:
    """Return the equations with the terms of the model's mechanisms.

    Raises:
        InputError: The model has events, whose states jump, or a mechanism that is no term of the equations.
    """
    system = extended_system(model, source)
    if system.events:
        raise InputError(
            f"{source}: model.events: {', '.join(one.name for one in system.events)}: states that jump are no "
            "differential equation; simulate the model, or export it as a unit (rtctl export fmu)"
        )
    return dynamics_of(system)


def dynamics_of(system: System) -> Dynamics:
    """Return the equations of a system, in the units of its signals and states."""
    states = np.array([one.factor for one in system.states])
    inputs = np.array([one.factor for one in system.inputs])
    p = np.array([one.value * one.factor for one in system.parameters])
    low, high = (np.array([getattr(one, word) for one in system.states]) for word in ("low", "high"))

    def places(t: float, x: FloatArray, u: FloatArray) -> Places:
        return Places((x * states)[None], (u * inputs)[None], np.array([t], dtype=np.float64))

    def rates(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        here = places(t, x, u)
        found = rates_at(system, here, p)[0]
        outward = ((here.x[0] <= low) & (found < 0.0)) | ((here.x[0] >= high) & (found > 0.0))
        return np.asarray(np.where(outward, 0.0, found) / states)

    def read(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        return np.asarray(outputs_at(system, places(t, x, u), p)[0])

    return Dynamics(
        kind="equations",
        inputs=tuple(Channel(name=one.name, unit=one.unit) for one in system.inputs),
        states=tuple(Channel(name=one.name, unit=one.unit) for one in system.states),
        outputs=tuple(Channel(name=one.name, unit=one.unit) for one in system.outputs),
        initial=np.array([one.initial / one.factor for one in system.states]),
        rates=rates,
        read=read,
    )
