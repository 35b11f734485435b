"""Hysteresis by proximity to the limiting loop (L2P): a tanh loop, and reversals that run back towards it.

    g = 1/2 + 1/2 tanh u,    u = beta (d w/2 + Tc - T - Tpr P(x)),    x = (T - Tr)/Tpr,
    P(x) = 1/2 (1 - sin(gamma x)) (1 + tanh(pi^2 - 2 pi x)),

`g` semiconducting fraction; `d` +1 heating, -1 cooling; `Tr` temperature of the last reversal; `Tpr` the
distance to the limiting branch at that moment, so that `g` is continuous there. L. A. L. de Almeida et al.,
"Modeling of the hysteretic metal-insulator transition in a vanadium dioxide infrared detector", Opt. Eng. 41
(2002) 2582.

Kept is `u`, not `g`: at a reversal `Tpr = d w/2 + Tc - Tr - u/beta` needs no inverse tanh, which would fail
where `g` rounds to 0 or 1. Minor loops do not close: this plant has no return-point memory.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np

from plant_sim.bounds import FINITE, POSITIVE
from plant_sim.kernels import Record, compiled
from plant_sim.vo2.domains import Floats
from rtctl.border.units.quantities import Checked, Quantity

HEATING = 1.0
COOLING = -1.0

DIRECTION, LAST, REVERSAL, PROXIMITY, ARGUMENT = 0, 1, 2, 3, 4
"""Columns of the memory: d, last T [degC], Tr [degC], Tpr [K], u."""


class Loop(Checked):
    """Limiting loop of one transition."""

    centre: Annotated[float, Quantity("degC"), FINITE]
    """Centre Tc [degC]."""
    width: Annotated[float, Quantity("K"), POSITIVE]
    """Width w [K]."""
    steepness: Annotated[float, Quantity("1/K"), POSITIVE]
    """Steepness beta [1/K]."""
    proximity: Annotated[float, Quantity(""), FINITE]
    """Parameter gamma of P(x)."""


class LimitingLoop(Checked):
    """The `[hysteresis]` table with `kind = "limiting-loop"`."""

    kind: Literal["limiting-loop"]
    electrical: Loop
    structural: Loop


def cold_memory(loop: Loop, temperature: float) -> Floats:
    """Return the memory at `temperature` [degC] on the heating branch, as a full cooling leaves it."""
    argument = loop.steepness * (0.5 * loop.width + loop.centre - temperature)
    return np.array([HEATING, temperature, temperature, 0.0, argument])


@compiled
def proximity(loop: Record, x: float) -> float:
    """Return P(x): near one at the reversal (x = 0), none from x of about two on."""
    away = 1.0 + math.tanh(math.pi**2 - 2.0 * math.pi * x)
    return 0.5 * (1.0 - math.sin(loop.proximity * x)) * away


@compiled
def follow(loop: Record, memory: Floats, temperature: float) -> float:
    """Follow a monotone move to `temperature` [degC]; return the transformed (metallic) fraction `1 - g`."""
    move = temperature - memory[LAST]
    if move * memory[DIRECTION] < 0.0:
        memory[DIRECTION] = -memory[DIRECTION]
        memory[REVERSAL] = memory[LAST]
        limit = memory[DIRECTION] * 0.5 * loop.width + loop.centre
        memory[PROXIMITY] = limit - memory[REVERSAL] - memory[ARGUMENT] / loop.steepness
    memory[LAST] = temperature
    distance = 0.0
    if memory[PROXIMITY] != 0.0:
        x = (temperature - memory[REVERSAL]) / memory[PROXIMITY]
        distance = memory[PROXIMITY] * proximity(loop, x)
    limit = memory[DIRECTION] * 0.5 * loop.width + loop.centre
    memory[ARGUMENT] = loop.steepness * (limit - temperature - distance)
    return 0.5 - 0.5 * math.tanh(memory[ARGUMENT])
