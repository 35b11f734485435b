"""`structure.resonance`: d + participation (q - d) is measured, q'' + 2 damping_ratio w q' + w^2 q = w^2 d.

w = 2 pi frequency, d the deflection of a beam without mass. A participation of 1 is a beam with one mode; the output
is linear in it, so that a fit starts from a stiff beam whatever the frequency.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import cos, exp, sin
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel
from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient, shape


class Swing(NamedTuple):
    """The mode q [um] and its rate [um/s]."""

    q: float
    speed: float


# 7 parameters because a kernel takes its numbers one by one
@kernel
def swing_over(  # noqa: PLR0913
    q: float, speed: float, before: float, now: float, h: float, rate: float, ratio: float
) -> Swing:  # fmt: skip
    """Return the mode after h [s] over which d moves linearly from `before` to `now` [um]; exact."""
    damped = rate * math.sqrt(1.0 - ratio * ratio)
    slope = (now - before) / h
    behind = 2.0 * ratio * slope / rate  # of the particular solution, a ramp
    e, f = q - before + behind, speed - slope
    c, s, decay = cos(damped * h), sin(damped * h) / damped, exp(-ratio * rate * h)
    return Swing(
        now - behind + decay * (e * c + (f + ratio * rate * e) * s),
        slope + decay * (f * c - (rate * rate * e + ratio * rate * f) * s),
    )


@background_kernel
def ringing(d: FloatArray, steps: FloatArray, rate: float, ratio: float) -> FloatArray:
    """Return q (instants,), at rest on the first d; d is linear between instants, over which the solution is exact."""
    q = np.empty_like(d)
    q[0], speed = d[0], 0.0
    for k in range(1, d.size):
        q[k], speed = swing_over(q[k - 1], speed, d[k - 1], d[k], steps[(k - 1) % steps.size], rate, ratio)
    return q


def swinging(read: Read, p: Values) -> Read:
    """Apply the beam's dynamic response to the deflection."""
    q = ringing(read.deflection, read.steps_s, 2.0 * math.pi * p["frequency"], p["damping_ratio"])
    return read._replace(deflection=read.deflection + p["participation"] * (q - read.deflection))


MECHANISM = Vo2Mechanism(
    id="structure.resonance",
    statement="The beam swings at {frequency}, damped by {damping_ratio}, with a participation of {participation}.",
    parameters=(
        coefficient("participation", "dimensionless", "of the mode in the deflection", 1.0, low=0.0, high=2.0),
        shape("frequency", "Hz", "of the mode", lambda s: 0.2 / s.period, low=1e-3, high=1e6, shape_range=(0.05, 20.0),
              grid=25),
        shape("damping_ratio", "dimensionless", "of the mode", 0.01, default=0.01, searched=True, low=1e-5, high=0.99,
              shape_range=(0.3, 50.0)),
    ),
    instrument=swinging,
    resolves=0.0625,
)  # fmt: skip
