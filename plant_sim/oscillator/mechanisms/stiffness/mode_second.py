"""`mode.second`: a second linear mode of angular frequency w = 2 pi frequency and damping c = 2 damping_ratio w.

Driven beside the first: q'' + c q' + w^2 q = gain u, the sensor reads z + q. It is linear and driven by the drive
alone, so it is computed by itself, exactly for a drive that is quadratic over each step.

Carried by the first (a mass on it): with y its place, z'' = ... + mass_ratio pull, y'' = -pull, where
pull = c (y' - z') + w^2 (y - z). It moves along with the device when a record begins.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.integration.linear import mode_response
from plant_sim.oscillator.mechanism import Memory, Moved, OscillatorMechanism, Values, coefficient, shape
from rtctl.border.arrays import ComplexArray


def beside(moved: Moved, p: Values) -> Moved:
    """Return the reading of both modes; the second's response is the same for all lanes but for its gain."""
    if p["gain"] == 0.0:
        return moved
    rate, ratio = 2.0 * math.pi * p["frequency"], p["damping_ratio"]
    (nodes, step_s), substeps = moved.drive, moved.substeps
    q, speed = moved.once(
        ("mode.second", rate, ratio), lambda: mode_response(nodes, step_s, substeps, rate, ratio)
    )
    course = [q, speed]
    if moved.derivatives:
        drive = np.append(nodes[:1, 0], nodes[substeps - 1 :: substeps, 2])
        acceleration = drive - 2.0 * ratio * rate * speed - rate**2 * q
        course = [q, speed, acceleration, np.gradient(acceleration, moved.period_s)]
    response, slope = course[moved.derivatives : moved.derivatives + 2]
    return moved._replace(
        displacement=moved.displacement + p["gain"] * response, velocity=moved.velocity + p["gain"] * slope
    )


def response(s: ComplexArray, derivatives: int, p: Values) -> ComplexArray:
    """Return so many derivatives of the mode's displacement, over the drive."""
    rate = 2.0 * math.pi * p["frequency"]
    return p["gain"] * s**derivatives / (s**2 + 2.0 * p["damping_ratio"] * rate * s + rate**2)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def carried(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rates; p: mass ratio, w^2 [1/s^2], c [1/s]; w: place and velocity of the mass."""
    pull = p[row + 2, j] * (w[1] - v) + p[row + 1, j] * (w[0] - z)
    return p[row, j] * pull, (w[1], -pull)


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants of `carried`."""
    rate = 2.0 * math.pi * p["frequency"]
    return p["mass_ratio"], rate * rate, 2.0 * p["damping_ratio"] * rate


def fastest_rate(p: Values, speed: float) -> float:
    """Return the rate of the carried mass against the device; the mode beside it is computed by itself."""
    if p["mass_ratio"] == 0.0:
        return 0.0
    return 2.0 * math.pi * p["frequency"] * math.sqrt(1.0 + p["mass_ratio"])


MECHANISM = OscillatorMechanism(
    id="mode.second",
    statement="A second mode at {frequency} is driven too ({gain}) and seen by the sensor, or is that of a mass on the "
    "device ({mass_ratio} of its own).",
    forms={
        "gain": "A second mode at {frequency} is driven too ({gain}) and seen by the sensor.",
        "mass_ratio": "A mass on the device, {mass_ratio} of its own, has a mode at {frequency}.",
    },
    parameters=(
        coefficient(
            "gain",
            "{z}/(s^2*({u}))",
            "of the drive on the second mode",
            lambda s: s.acceleration / s.drive,
            default=0.0,
        ),
        coefficient(
            "mass_ratio",
            "dimensionless",
            "of a mass that the device carries on a spring, to its own",
            lambda s: 0.2,
            default=0.0,
            low=0.0,
        ),
        shape(
            "frequency",
            "Hz",
            "of the second mode",
            lambda s: s.rate / (2.0 * math.pi),
            shape_range=(0.3, 20.0),
            grid=5,
        ),
        shape("damping_ratio", "dimensionless", "of the second mode", lambda s: 0.01, default=0.01),
    ),
    memory=Memory(carried, 2, constants, acts=lambda p: p["mass_ratio"] != 0.0, start=lambda z, v: (z, v)),
    sensor=beside,
    beside=response,
    fastest_rate=fastest_rate,
)
