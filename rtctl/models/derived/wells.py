"""The wells of a bistable oscillator: rest positions of f(z) = sum c_p z^p with f'(0) < 0 < f'(z_w).

Between 0 and a well the force -f pushes outwards; its largest size there is the least steady force that leaves it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

Polynomial = Mapping[int, float]
"""Coefficients of the restoring force per mass by power of the displacement."""


def well_of(force: Polynomial, side: float = 1.0) -> float:
    """Return the displacement of the well on the positive side, or the negative one for `side` = -1; NaN: none."""
    highest = max(force)
    ascending = np.zeros(highest)
    for power, value in force.items():
        ascending[power - 1] += value * side ** (power - 1)  # f(z) / z
    roots = np.roots(ascending[::-1])
    real = np.sort(roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0.0)])
    stable = [float(root) for root in real if stiffness_at(force, side * float(root)) > 0.0]
    return side * stable[0] if stable else math.nan


def stiffness_at(force: Polynomial, z: float) -> float:
    """Return f'(z)."""
    return sum(power * value * z ** (power - 1) for power, value in force.items())


def barrier_of(force: Polynomial, well: float) -> float:
    """Return the largest size of the force between 0 and a well; NaN without a well."""
    if not math.isfinite(well):
        return math.nan
    highest = max(force)
    slope = np.zeros(highest)
    for power, value in force.items():
        slope[power - 1] += power * value
    roots = np.roots(slope[::-1])
    share = roots.real[np.abs(roots.imag) < 1e-9 * np.maximum(np.abs(roots), 1e-300)] / well
    inside = share[(share > 0.0) & (share < 1.0)] * well
    return max(
        (abs(sum(value * z**power for power, value in force.items())) for z in inside), default=math.nan
    )
