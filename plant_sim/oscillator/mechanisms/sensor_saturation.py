"""`sensor.saturation`: tanh(sqrt(curvature) z) / sqrt(curvature) is read instead of z."""

from __future__ import annotations

import math

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient


def saturated(moved: Moved, p: Values) -> Moved:
    """The reading compressed where it is large: z (1 - curvature z^2 / 3 + ...)."""
    if p["curvature"] == 0.0:
        return moved
    root = math.sqrt(p["curvature"])
    return moved._replace(displacement=np.tanh(root * moved.displacement) / root)


MECHANISM = OscillatorMechanism(
    id="sensor.saturation",
    statement="The displacement sensor saturates, with a curvature of {curvature}.",
    parameters=(
        coefficient(
            "curvature",
            "1/({z})^2",
            "inverse square of the largest reading: z (1 - curvature z^2 / 3 + ...)",
            lambda s: 3.0 / s.displacement**2,
            low=0.0,
        ),
    ),
    sensor=saturated,
    stage=2,
)
