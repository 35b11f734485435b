"""`sensor.lag`: y with time_constant y' = z - y is read instead of z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from plant_sim.oscillator.integration.linear import lag
from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient

HERMITE: NDArray[np.float64] = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-3.0, -2.0, 3.0, -1.0], [2.0, 1.0, -2.0, 1.0]]
)
"""Matrix: coefficients of 1, s, s^2, s^3 from value and slope at s = 0 and s = 1."""


def lagging(moved: Moved, p: Values) -> Moved:
    """Return the reading behind a first-order lag, settled at first; exact for the cubic through z and z'."""
    if p["time_constant"] == 0.0:
        return moved
    z, slope = moved.displacement, moved.velocity * moved.period_s
    ends = lag(moved.period_s / p["time_constant"], 3).end
    w = ends @ HERMITE
    reading = np.empty_like(z)
    reading[0] = z[0]
    reading[1:] = w[0] * z[:-1] + w[1] * slope[:-1] + w[2] * z[1:] + w[3] * slope[1:]
    return moved._replace(displacement=lfilter([1.0], [1.0, ends[0] - 1.0], reading))


MECHANISM = OscillatorMechanism(
    id="sensor.lag",
    statement="The sensor lags with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the reading behind the motion", lambda s: 1.0 / s.rate, low=0.0
        ),
    ),
    sensor=lagging,
    looks_between=True,
    stage=1,
)
