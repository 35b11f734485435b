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


def unread(reading: float, p: Values) -> float:
    """What is read so; a reading that noise took beyond the largest one is left as it is."""
    root = math.sqrt(p["curvature"])
    return math.atanh(root * reading) / root if 0.0 < abs(root * reading) < 1.0 else reading


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
    unread=unread,
    stage=2,
)
