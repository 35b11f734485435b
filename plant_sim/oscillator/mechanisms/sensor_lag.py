"""`sensor.lag`: time_constant y' = z - y is read."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.linear import linear_response
from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient


def lagging(moved: Moved, p: Values) -> Moved:
    """A first-order follower of the motion between samples (cubic through displacement and velocity), settled at first.

    The cubic is a quadratic through three of its values over each half of the interval, to the fourth order.
    """
    if p["time_constant"] <= 0.0:
        return moved
    z, v, h = moved.displacement, moved.velocity, moved.period_s
    middle = 0.5 * (z[:-1] + z[1:]) + 0.125 * h * (v[:-1] - v[1:])
    first = 0.84375 * z[:-1] + 0.15625 * z[1:] + h * (0.140625 * v[:-1] - 0.046875 * v[1:])
    last = 0.15625 * z[:-1] + 0.84375 * z[1:] + h * (0.046875 * v[:-1] - 0.140625 * v[1:])
    nodes = np.empty((2 * (len(z) - 1), 3))
    nodes[::2] = np.column_stack((z[:-1], first, middle))
    nodes[1::2] = np.column_stack((middle, last, z[1:]))
    a, b = np.array([[-1.0 / p["time_constant"]]]), np.array([1.0 / p["time_constant"]])
    return moved._replace(displacement=linear_response(a, b, nodes, 0.5 * h, 2, start=z[:1])[:, 0])


MECHANISM = OscillatorMechanism(
    id="sensor.lag",
    statement="The displacement sensor lags with a time constant of {time_constant}.",
    parameters=(coefficient("time_constant", "s", "of the lag", lambda s: 1.0 / s.rate, low=0.0),),
    sensor=lagging,
    stage=1,
)
