"""Backbone of an undamped oscillator with odd restoring force, by harmonic balance.

    z'' + k z + k3 z^3 + k5 z^5 = 0,   z(t) = sum_n a_n cos(n W t),   n = 1, 3, 5, 7, ...

Of a motion with a given first harmonic a_1 (what a lock-in measures) the unknowns are W^2 and the other a_n. The force
is sampled over one cycle, F_n are its cosine coefficients, and Newton's method solves F_n - n^2 W^2 a_n = 0; the
Jacobian is exact, from the sampled stiffness (alternating frequency/time). A damped oscillator that is driven 90
degrees ahead of its displacement moves along this curve: there the drive only feeds the losses.
Reference: M. Krack, J. Gross, Harmonic Balance for Nonlinear Vibration Problems (Springer 2019), chapters 2 and 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray

HARMONICS = (1, 3, 5, 7, 9)
SAMPLES = 128
"""Samples of one cycle: the fifth power of the ninth harmonic reaches the 45th, and aliases beyond 118."""
MOST_ITERATIONS = 40
CONVERGED = 1e-13


class Backbone(NamedTuple):
    """One point of the backbone curve."""

    frequency_hz: float
    coefficients: FloatArray
    """Cosine coefficient a_n of each harmonic [unit of the amplitude]."""
    converged: bool
    iterations: int


def backbone(
    amplitude: float,
    *,
    stiffness: float,
    cubic: float,
    quintic: float = 0.0,
    harmonics: tuple[int, ...] = HARMONICS,
) -> Backbone:
    """Return the free vibration with a given first harmonic.

    Args:
        amplitude: First harmonic >= 0 [z].
        stiffness: Linear stiffness [1/s^2].
        cubic: Cubic stiffness [1/(z^2 s^2)].
        quintic: Quintic stiffness [1/(z^4 s^2)].
        harmonics: Odd harmonics, starting with 1.

    Raises:
        ValueError: The linear stiffness is not > 0 (the backbone of a bistable oscillator does not start at rest).
    """
    if not stiffness > 0.0:
        raise ValueError(f"stiffness must be > 0 1/s^2 for a backbone from rest, got {stiffness!r}")
    order = np.array(harmonics, dtype=np.float64)
    angle = 2.0 * math.pi * np.arange(SAMPLES) / SAMPLES
    basis = np.cos(np.outer(order, angle))
    a = np.zeros(len(order))
    a[0] = amplitude
    squared = stiffness + 0.75 * cubic * amplitude**2 + 0.625 * quintic * amplitude**4  # one harmonic alone
    if amplitude == 0.0:
        return Backbone(math.sqrt(stiffness) / (2.0 * math.pi), a, True, 0)
    converged, iterations = False, 0
    while not converged and iterations < MOST_ITERATIONS:
        iterations += 1
        z = a @ basis
        force = z * (stiffness + z**2 * (cubic + z**2 * quintic))
        residual = 2.0 / SAMPLES * (basis @ force) - order**2 * squared * a
        slope = stiffness + z**2 * (3.0 * cubic + 5.0 * quintic * z**2)
        jacobian = 2.0 / SAMPLES * (basis * slope) @ basis.T - np.diag(order**2 * squared)
        jacobian[:, 0] = -(order**2) * a  # the first unknown is W^2: a_1 is given
        change = np.linalg.solve(jacobian, -residual)
        squared += change[0]
        a[1:] += change[1:]
        size = max(abs(change[0]) / stiffness, float(np.abs(change[1:]).max(initial=0.0)) / amplitude)
        converged = size < CONVERGED
    frequency = math.sqrt(squared) / (2.0 * math.pi) if squared > 0.0 else math.nan
    return Backbone(frequency, a, converged and squared > 0.0, iterations)
