"""`sensor.saturation`: the reading is tanh(sqrt(curvature) z) / sqrt(curvature)."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient


def saturated(moved: Moved, p: Values) -> Moved:
    """The reading compressed at large displacements: z (1 - curvature z^2 / 3 + ...)."""
    root = np.sqrt(p["curvature"])
    z = moved.displacement
    return moved._replace(displacement=np.tanh(root * z) / root if root > 0.0 else z)


MECHANISM = OscillatorMechanism(
    id="sensor.saturation",
    statement="The displacement sensor saturates (curvature {curvature}).",
    parameters=(
        coefficient(
            "curvature",
            "1/{z}^2",
            "inverse square of the largest reading",
            lambda s: 1.0 / s.displacement**2,
            low=0.0,
        ),
    ),
    sensor=saturated,
    stage=2,
)
