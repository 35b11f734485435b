"""`sensor.crosstalk`: the reading plus gain u + rate u' is read: the drive leaks into it (feedthrough).

gain is a path through a resistance or the mount, rate one through a capacitance. In a sweep they are the in-phase and
the quadrature part of a background that is proportional to the drive. Where a converter steps at the sample's instant,
no manifest says whether the reading is taken before or after: `before` is the share of before. A drive that is held
has no rate of change but at its steps, which no reading meets.

Reference: J. E.-Y. Lee, A. A. Seshia, Sensors and Actuators A 156 (2009) 36 (feedthrough of resonators).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient, shape
from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.units.quantities import convert

NEAR_ONE = 0.03
"""Difference of a gain from one within which the whole drive is read: two sensors are calibrated no better."""
AGAINST_THE_GROUND = (
    "That is the whole drive, once: if it is the motion of the base, a sensor that reads against the ground (an "
    "accelerometer on the device) has it in its reading by nature, and no cable is at fault."
)


def leaking(moved: Moved, p: Values) -> Moved:
    """Return the reading with the drive added."""
    if p["gain"] == 0.0 and p["rate"] == 0.0:
        return moved
    (nodes, step_s), substeps = moved.drive, moved.substeps
    start, middle, end = nodes.T
    slope_at_end = (3.0 * end - 4.0 * middle + start) / step_s  # of the parabola through the three
    slope_at_start = (4.0 * middle - 3.0 * start - end) / step_s

    def read(before: FloatArray, after: FloatArray) -> FloatArray:
        first, last = (
            np.append(after[:1], before[substeps - 1 :: substeps]),
            np.append(after[::substeps], before[-1:]),
        )
        seen: FloatArray = p["before"] * first + (1.0 - p["before"]) * last
        return seen

    drive, change = read(end, start), read(slope_at_end, slope_at_start)
    return moved._replace(
        displacement=moved.displacement + p["gain"] * drive + p["rate"] * change,
        filtered_slope=moved.slope + p["gain"] * change,
    )


def background(s: ComplexArray, derivatives: int, p: Values) -> ComplexArray:
    """Return what is read beside the motion, over the drive, at complex angular frequency s [1/s]."""
    return p["gain"] + p["rate"] * s


def against_the_ground(values: Mapping[str, tuple[float, str]]) -> str:
    """Say what a gain of one in equal units is by nature: the reading of a device that its base moves."""
    gain = values.get("gain")
    try:
        share = convert(*gain, "1") if gain else 0.0
    except ValueError:  # other units than the drive's
        return ""
    return AGAINST_THE_GROUND if abs(abs(share) - 1.0) < NEAR_ONE else ""


MECHANISM = OscillatorMechanism(
    id="sensor.crosstalk",
    statement="The drive leaks into the reading (feedthrough): {gain} of it and {rate} of its rate of change are read "
    "beside the motion.",
    parameters=(
        coefficient(
            "gain", "{y}/({u})", "of the drive on the reading", lambda s: s.reading / s.drive, default=0.0
        ),
        coefficient(
            "rate",
            "{y}*s/({u})",
            "of the drive's rate of change on the reading",
            lambda s: s.reading / (s.drive * s.rate),
            default=0.0,
        ),
        shape(
            "before",
            "dimensionless",
            "share of the reading that is taken before the drive steps",
            lambda s: 1.0,
            default=1.0,
            low=0.0,
            high=1.0,
            shape_range=(0.0, 1.0),
        ),
    ),
    aside=against_the_ground,
    sensor=leaking,
    beside=background,
)
