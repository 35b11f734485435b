"""`mode.second`: q'' + 2 damping_ratio w q' + w^2 q = gain u, w = 2 pi frequency; the sensor reads z + q.

The second mode is linear and driven by the drive alone, so it is computed by itself, exactly for a drive that is
quadratic over each step.
"""

from __future__ import annotations

import math

from plant_sim.oscillator.linear import mode_response
from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient, shape


def beside(moved: Moved, p: Values) -> Moved:
    """The reading of both modes; the second's response is the same for all lanes but for its gain."""
    rate, ratio = 2.0 * math.pi * p["frequency"], p["damping_ratio"]
    (nodes, step_s), substeps = moved.drive, moved.substeps
    q, speed = moved.once(
        ("mode.second", rate, ratio), lambda: mode_response(nodes, step_s, substeps, rate, ratio)
    )
    return moved._replace(
        displacement=moved.displacement + p["gain"] * q, velocity=moved.velocity + p["gain"] * speed
    )


MECHANISM = OscillatorMechanism(
    id="mode.second",
    statement="A second mode at {frequency} is driven too ({gain}) and seen by the sensor.",
    parameters=(
        coefficient(
            "gain", "{z}/(s^2*({u}))", "of the drive on the second mode", lambda s: s.acceleration / s.drive
        ),
        shape(
            "frequency",
            "Hz",
            "of the second mode",
            lambda s: s.rate / (2.0 * math.pi),
            shape_range=(0.3, 8.0),
        ),
        shape("damping_ratio", "dimensionless", "of the second mode", lambda s: 0.01, default=0.01),
    ),
    sensor=beside,
)
