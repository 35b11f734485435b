"""Semiconductor and metal of a film that has changed phase in part, and the beam that both bend.

Identified loops give y = -ln R and the deflection by temperature alone. Where the transition lags or creeps, only the
switched share phi does: the pure phases follow temperature at once. By Lichtenecker's mixing

    exp(n y) = (1 - phi) exp(n y_s(T)) + phi exp(n y_m),  y_s = y_0 + activation (T - T_0),

n = 0 is the logarithmic one; y_0 and y_m are the readings of the highest and the lowest identified resistance,
T_0 is held by the lowest current. The beam bends by -expansion T where nothing switches.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import expm1, log1p
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel

LEAST_CONTRAST = 0.2
"""Least contrast of a semiconductor to its metal, relative to that of the cold film."""
LOGARITHMIC = 1e-6
"""Exponent below which the mixing is logarithmic."""
LEAST = -0.99
"""Lower limit of x in the logarithm of 1 + x."""


class Phases(NamedTuple):
    """Phases of the film; T in mA^2 of a linear loss."""

    cold: float
    """Reading -ln R at `coldest`."""
    metal: float
    """Reading -ln R of the metal."""
    coldest: float
    """Lowest identified temperature [mA^2]; nothing switches below it."""
    hottest: float
    """Highest identified temperature [mA^2]; nothing switches above it."""
    activation: float = 0.0
    """Activation of the semiconductor [1/mA^2]."""
    mixing: float = 0.0

    def of(self, p: Mapping[str, float]) -> Phases:
        """Return the phases with a mechanism's own shapes."""
        return self._replace(activation=p["activation"], mixing=p["mixing"])


@kernel
def semiconductor(T: float, film: Phases) -> float:
    """Return -ln R of the film without any metal."""
    most = film.metal - LEAST_CONTRAST * (film.metal - film.cold)
    return min(film.cold + film.activation * (T - film.coldest), most)


@kernel
def switched(reading: float, T: float, film: Phases) -> float:
    """Return phi at -ln R and T."""
    pure = semiconductor(T, film)
    if abs(film.mixing) < LOGARITHMIC:
        return (reading - pure) / (film.metal - pure)
    return expm1(film.mixing * (reading - pure)) / expm1(film.mixing * (film.metal - pure))


@kernel
def mixed(phi: float, T: float, film: Phases) -> float:
    """Return -ln R at phi and T."""
    pure = semiconductor(T, film)
    if abs(film.mixing) < LOGARITHMIC:
        return pure + phi * (film.metal - pure)
    return pure + log1p(max(phi * expm1(film.mixing * (film.metal - pure)), LEAST)) / film.mixing


@background_kernel
def switched_along(reading: FloatArray, T: FloatArray, film: Phases) -> FloatArray:
    """Return `switched` of each instant (n,)."""
    found = np.empty(reading.size)
    for k in range(reading.size):
        found[k] = switched(reading[k], T[k], film)
    return found


@background_kernel
def mixed_along(phi: FloatArray, T: FloatArray, film: Phases) -> FloatArray:
    """Return `mixed` of each instant (n,)."""
    found = np.empty(phi.size)
    for k in range(phi.size):
        found[k] = mixed(phi[k], T[k], film)
    return found
