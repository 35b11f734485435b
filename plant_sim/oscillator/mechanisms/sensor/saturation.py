"""`sensor.saturation`: tanh(sqrt(curvature) z) / sqrt(curvature) is read instead of z, or no more than +-limit."""

from __future__ import annotations

import math

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient, shape
from rtctl.border.arrays import FloatArray


def saturated(moved: Moved, p: Values) -> Moved:
    """Return the reading compressed where it is large, or cut off."""
    return moved._replace(displacement=bent(moved.displacement, p))


def bent(z: FloatArray, p: Values) -> FloatArray:
    """Return values compressed where they are large, z (1 - curvature z^2 / 3 + ...), or cut off."""
    if p["curvature"] > 0.0:
        root = math.sqrt(p["curvature"])
        z = np.tanh(root * z) / root
    if p["clipped"] > 0.0:
        z = z - p["clipped"] * (z - np.clip(z, -p["limit"], p["limit"]))
    return z


def unread(reading: float, p: Values) -> float:
    """Return the displacement of a reading; one beyond the largest, by noise, or one that is cut off stays as it is."""
    beyond = abs(reading) - p["limit"]
    if beyond > 0.0 and 0.0 < p["clipped"] < 1.0:
        reading = math.copysign(p["limit"] + beyond / (1.0 - p["clipped"]), reading)
    root = math.sqrt(p["curvature"])
    return math.atanh(root * reading) / root if 0.0 < abs(root * reading) < 1.0 else reading


MECHANISM = OscillatorMechanism(
    id="sensor.saturation",
    statement=(
        "The sensor saturates, with a curvature of {curvature}, and cuts {clipped} of what is beyond {limit}."
    ),
    forms={
        "curvature": "The sensor saturates, with a curvature of {curvature}.",
        "clipped": "The sensor clips at {limit}, of either sign: {clipped} of what is beyond is cut off.",
    },
    parameters=(
        coefficient(
            "curvature",
            "1/({y})^2",
            "inverse square of the largest reading: z (1 - curvature z^2 / 3 + ...)",
            lambda s: 3.0 / s.reading**2,
            default=0.0,
            low=0.0,
        ),
        coefficient(
            "clipped",
            "dimensionless",
            "share of the reading beyond the limit that is not read; 1: none of it is",
            lambda s: 1.0,
            default=0.0,
            low=0.0,
            high=1.0,
        ),
        shape(
            "limit",
            "{y}",
            "beyond which less is read",
            # RMS says nothing of it: a resonance in a sweep reaches many times that
            lambda s: s.largest_reading,
            default=1.0,
            searched=True,
            shape_range=(0.2, 1.02),
            grid=7,
            of_form="clipped",
        ),
    ),
    sensor=saturated,
    unread=unread,
    stage=3,
)
