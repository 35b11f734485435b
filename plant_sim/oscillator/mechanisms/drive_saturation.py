"""`drive.saturation`: 3 L(x) / sqrt(curvature), x = sqrt(curvature) u, L(x) = coth x - 1 / x (Langevin)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient
from plant_sim.oscillator.pointwise import pointwise

FloatArray = NDArray[np.float64]
SMALL = 0.5
"""Below it coth x - 1 / x loses digits: 3e-16 / x^2 of the drive."""
SERIES = (
    1.0, -1 / 15, 2 / 315, -1 / 1575, 2 / 31185, -1382 / 212837625, 4 / 6081075, -3617 / 54273594375,
)  # fmt: skip
"""3 L(x) / x in powers of x^2."""


def saturated(drive: Driven, p: Values) -> Driven:
    """The drive as a magnetisation follows it: u (1 - curvature u^2 / 15 + ...)."""
    if p["curvature"] == 0.0:
        return drive
    root = math.sqrt(p["curvature"])
    return pointwise(drive, lambda u: langevin(root * u) * (3.0 / root))


def langevin(x: FloatArray) -> FloatArray:
    """coth x - 1 / x."""
    small = np.abs(x) < SMALL
    series = x / 3.0 * np.polynomial.polynomial.polyval(x * x, SERIES)
    if small.all():
        return series
    large = np.where(small, 1.0, x)
    return np.where(small, series, 1.0 / np.tanh(large) - 1.0 / large)


MECHANISM = OscillatorMechanism(
    id="drive.saturation",
    statement="The drive saturates as a magnetisation does (Langevin), with a curvature of {curvature}.",
    parameters=(
        coefficient(
            "curvature",
            "1/({u})^2",
            "inverse square of the drive at which it bends: u (1 - curvature u^2 / 15 + ...)",
            lambda s: 15.0 / s.drive**2,
            low=0.0,
        ),
    ),
    drive=saturated,
    stage=4,
)
