"""The cubature Kalman filter of a user's equations as an exported estimator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.border.errors import InputError
from rtctl.estimators.cubature import CubatureFilter
from rtctl.estimators.equations.cubature_kernel import filter_step, room_size
from rtctl.estimators.equations.laws import law_function
from rtctl.estimators.equations.rest import state_at_rest
from rtctl.export.c.laws.parts import Part
from rtctl.translation.memory import Memory

BELIEF = "of a motion of the equations: rtctl.plants.equations.belief"
SOURCES = {
    "inputs.factors": "units of model.inputs",
    "kalman.parameters": "model.parameters, in SI base units, in their order",
    "kalman.low": "low of model.states",
    "kalman.high": "high of model.states",
    "kalman.scale": BELIEF,
    "kalman.added": BELIEF,
    "kalman.noise": "noise of device.outputs",
    "kalman.step_s": "of the fastest rate of the equations",
}


class Inputs(NamedTuple):
    """The inputs of the equations."""

    factors: FloatArray
    """SI base units of each command's unit."""


def kalman_part(model: StateSpace, estimator: CubatureFilter, levels: tuple[float, ...]) -> Part:
    """Return the filter of a model, at rest at some levels. Raises InputError where it has no form in C."""
    if len(model.directions):
        raise InputError(
            "export c: the filter of equations with events has no form in C; export the loop with estimator.kind = "
            '"none", or write the equations without model.events'
        )
    if model.sources.own:
        raise InputError(
            "export c: the filter of equations that call functions of a Python class has no form in C"
        )
    n, m = len(model.initial), len(model.sensed)
    names = ", ".join(model.states)
    return Part(
        name="kalman",
        function=_filter(law_function(model, "rates"), law_function(model, "outputs")),
        constants={"inputs": Inputs(model.input_factors), "kalman": estimator.params},
        memory=(
            Memory("states", state_at_rest(model, levels), f"of the filter [SI]: {names}"),
            Memory(
                "root", np.eye(n).ravel(), "root of their covariance, in units of kalman.scale, row after row"
            ),
            Memory("inputs", np.zeros(len(levels)), "[SI]"),
            Memory("readings", np.zeros(m), "as they were taken"),
            Memory("room", np.zeros(room_size(n, m, len(model.outputs))), "numbers of a step"),
        ),
        sources=SOURCES,
    )


def _filter(rates: Callable[..., int], outputs: Callable[..., int]) -> Callable[..., Any]:
    def kalman(
        s: Any, c: Any, level: float, sensed: float, elapsed_s: float
    ) -> tuple[float, float, float, int]:
        """Return the controlled output, the innovation, the standard error of the output, status bits."""
        s.inputs[0] = level * c.inputs.factors[0]
        s.readings[0] = sensed
        value, innovation, error, status = filter_step(
            rates, outputs, s.states, s.root, s.inputs, s.readings, elapsed_s, c.kalman, s.room
        )
        return value, innovation, error, status

    return kalman
