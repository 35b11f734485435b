"""Joule heating of the cantilever, one temperature: `dT/dt = (T0 - T)/tau + (k/tau) i^2`.

Equation (1) of the composite-model paper (IEEE/ASME Trans. Mechatronics 21(5), 2016), with the steady state
`T0 + k i^2` written out. Under a constant current the solution is an exponential, so the propagator is exact
for any step, and the temperature is monotone within one: hysteresis evaluated at the end of a hold is exact.
A mechanism that breaks this (a second time constant) has to divide the hold itself.
"""

from __future__ import annotations

import math
from typing import Annotated

from plant_sim.bounds import FINITE, POSITIVE
from plant_sim.kernels import Record, compiled
from rtctl.border.units.quantities import Checked, Quantity


class Heating(Checked):
    """The `[heating]` table."""

    ambient: Annotated[float, Quantity("degC"), FINITE]
    """T0, the temperature at zero current [degC]."""
    time_constant: Annotated[float, Quantity("s"), POSITIVE]
    """Time constant tau [s]."""
    gain: Annotated[float, Quantity("K/mA^2"), POSITIVE]
    """k, steady rise per squared current [K/mA^2]."""


@compiled
def heat(heating: Record, temperature: float, current: float, dt: float) -> float:
    """Return the temperature [degC] after `current` [mA] was held for `dt` [s] from `temperature` [degC]."""
    steady: float = heating.ambient + heating.gain * current * current
    return steady + (temperature - steady) * math.exp(-dt / heating.time_constant)
