"""Resistance of a film that is partly a semiconductor, `R_s = R_0 exp(E_a / kT)`, and partly a metal, `R_m`.

Three mixing laws by the metallic fraction `f`:

- logarithmic (Lichtenecker): `ln R = (1 - f) ln R_s + f ln R_m`;
- Bruggeman's effective medium in d dimensions: the conductance G with
  `f (G_m - G)/(G_m + (d-1) G) + (1 - f)(G_s - G)/(G_s + (d-1) G) = 0`, a quadratic with one positive root;
- series: `R = (1 - f) R_s + R_m`, as the limiting-loop model has it.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from plant_sim.bounds import POSITIVE
from plant_sim.kernels import Record, compiled
from rtctl.border.errors import nearest
from rtctl.border.units.quantities import Checked, Quantity

KELVIN = 273.15


class Mixing(IntEnum):
    """Mixing laws; a file writes the name in lower case."""

    LOGARITHMIC = 0
    BRUGGEMAN = 1
    SERIES = 2


LOGARITHMIC, BRUGGEMAN = int(Mixing.LOGARITHMIC), int(Mixing.BRUGGEMAN)
"""Number of the law for the kernel."""


def _mixing(raw: Any) -> Mixing:
    names = {law.name.lower(): law for law in Mixing}
    if not isinstance(raw, str) or raw not in names:
        raise ValueError(f"unknown mixing law {raw!r}{nearest(str(raw), names)}")
    return names[raw]


class Resistance(Checked):
    """The `[resistance]` table."""

    mixing: Annotated[Mixing, BeforeValidator(_mixing)]
    prefactor: Annotated[float, Quantity("ohm"), POSITIVE]
    """R_0, the semiconductor's resistance extrapolated to infinite temperature [ohm]."""
    activation: Annotated[float, Quantity("K"), POSITIVE]
    """Activation temperature E_a / k [K]."""
    metal: Annotated[float, Quantity("ohm"), POSITIVE]
    """Metallic resistance R_m [ohm]."""
    dimension: Annotated[float, Quantity(""), Field(gt=1.0, le=3.0)] = 2.0
    """Dimension d of Bruggeman's law: 2 in a film that is thin against its grains, 3 in a thick one."""


@compiled
def semiconductor_at(prefactor: float, activation: float, temperature: float) -> float:
    """Return R_s [ohm] at `temperature` [degC], of `prefactor` [ohm] and `activation` [K]."""
    return prefactor * math.exp(activation / (temperature + KELVIN))


@compiled
def bruggeman(semiconductor: float, metal: float, fraction: float, dimension: float) -> float:
    """Return the effective resistance [ohm] of `fraction` at `metal` [ohm], the rest at `semiconductor` [ohm]."""
    g_s, g_m = 1.0 / semiconductor, 1.0 / metal
    b = (dimension * fraction - 1.0) * g_m + (dimension * (1.0 - fraction) - 1.0) * g_s
    root = math.sqrt(b * b + 4.0 * (dimension - 1.0) * g_m * g_s)
    return 2.0 * (dimension - 1.0) / (b + root)


@compiled
def resistance_at(film: Record, temperature: float, fraction: float) -> float:
    """Return the resistance [ohm] at `temperature` [degC] with the metallic `fraction`."""
    semiconductor = semiconductor_at(film.prefactor, film.activation, temperature)
    if film.mixing == LOGARITHMIC:
        return float(semiconductor ** (1.0 - fraction) * film.metal**fraction)
    if film.mixing == BRUGGEMAN:
        return bruggeman(semiconductor, film.metal, fraction, film.dimension)
    return float((1.0 - fraction) * semiconductor + film.metal)
