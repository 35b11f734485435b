"""The steps of an exported model: those of its simulation of some records, or what its rates at the start need."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from plant_sim.equations.integration.steps import Places, Plan, plan, slopes
from plant_sim.equations.marching import Marching
from plant_sim.equations.mechanisms.courses import Acting, Inputs
from plant_sim.equations.model import equations_simulation
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import InputError
from rtctl.border.exported.c_plant import CRequest
from rtctl.border.simulation import Stimulus

LEVELS = (0.0, 1.0)
"""Levels [their units] of all inputs at which the rates at the start are looked at."""
SWING = 0.1
"""Least motion of a state [its unit] that is reckoned with at the start."""
SAMPLES_PER_PERIOD = 32.0
"""Communication points that are proposed in a period of the fastest turning rate."""
SLOWEST_S = 1.0
"""Communication step that is proposed for a model whose rates at the start are all zero [s]."""


def steps_for(
    model: EquationsFile, system: System, source: str, request: CRequest, acting: Sequence[Acting]
) -> tuple[Plan, float]:
    """Return the integrator's steps between two communication points, and the time between these [s].

    Args:
        model: The model.
        system: Its equations with the terms of mechanisms.
        source: Its file, for messages.
        request: What an export asks.
        acting: Mechanisms of its inputs.

    Raises:
        InputError: No sensible step resolves the model; it names `source`.
    """
    try:
        if request.stimuli:
            factors = equations_simulation(model, request.units, source).input_factors
            period_s = request.stimuli[0].period_s
            plans = [_resolving(system, one, factors, acting) for one in request.stimuli]
            finest = min(one.period_s / how.substeps for one, how in zip(request.stimuli, plans, strict=True))
            step_s = request.step_s or period_s
            implicit = any(how.implicit for how in plans)
            return Plan(max(1, math.ceil(step_s / finest - 1e-9)), implicit), step_s
        jacobians = _slopes_at_start(system)
        step_s = request.step_s or _proposed(jacobians)
        return plan(jacobians, step_s, None), step_s
    except ValueError as error:
        raise InputError(f"{source}: {error}") from None


def _resolving(system: System, stimulus: Stimulus, factors: FloatArray, acting: Sequence[Acting]) -> Plan:
    """Return the steps with which a record is simulated; inputs are `factors` (inputs,) SI units each."""
    start = np.array([[stimulus.initial.get(one.name, one.initial)] for one in system.states])
    p = _parameters(system)[:, None]
    nodes = Inputs(stimulus, system, factors, acting).nodes
    return Marching(system, stimulus, nodes, start, p, np.zeros(len(p)), uniform=True).resolve()


def _parameters(system: System) -> FloatArray:
    return np.array([one.value * one.factor for one in system.parameters])


def _slopes_at_start(system: System) -> FloatArray:
    """Return the Jacobians (places, states, states) [1/s] at the start, the inputs being 0 or 1 of their units."""
    start = np.array([one.initial for one in system.states])
    inputs = np.array([[level * one.factor for one in system.inputs] for level in LEVELS])
    places = Places(np.tile(start, (len(LEVELS), 1)), inputs, np.zeros(len(LEVELS)))
    swing = np.maximum(np.abs(start), SWING * np.array([one.factor for one in system.states]))
    return slopes(system, places, _parameters(system), swing)


def _proposed(jacobians: FloatArray) -> float:
    """Return a communication step [s] of two digits that follows the fastest rate."""
    fastest = float(np.abs(np.linalg.eigvals(jacobians)).max(initial=0.0))
    if fastest == 0.0:
        return SLOWEST_S
    return float(f"{2.0 * math.pi / (fastest * SAMPLES_PER_PERIOD):.1e}")
