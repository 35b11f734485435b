"""`drive.saturation`: 3 L(x) / sqrt(curvature), x = sqrt(curvature) u, L(x) = coth x - 1 / x (Langevin)."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Driven, OscillatorMechanism, Values, coefficient

SMALL = 1e-2
"""Below it the series is exact to the last bits, where coth x - 1 / x has none left."""


def saturated(drive: Driven, p: Values) -> Driven:
    """The drive as a magnetisation follows it: u (1 - curvature u^2 / 15 + ...)."""
    root = np.sqrt(p["curvature"])
    u = drive.nodes
    x = root * u
    square = x * x
    series = u * (1.0 - square / 15.0 * (1.0 - square * (2.0 / 21.0) * (1.0 - square / 10.0)))
    large = np.where(np.abs(x) < SMALL, 1.0, x)
    langevin = 3.0 * (1.0 / np.tanh(large) - 1.0 / large) / (root or 1.0)
    return drive._replace(nodes=np.where(np.abs(x) < SMALL, series, langevin))


MECHANISM = OscillatorMechanism(
    id="drive.saturation",
    statement="The drive saturates as a magnetisation does (Langevin; curvature {curvature}).",
    parameters=(
        coefficient(
            "curvature",
            "1/({u})^2",
            "inverse square of the saturating drive",
            lambda s: 1.0 / s.drive**2,
            low=0.0,
        ),
    ),
    drive=saturated,
    stage=4,
)
