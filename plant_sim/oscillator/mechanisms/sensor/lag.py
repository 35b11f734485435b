"""`sensor.lag`: y with time_constant y' = z - y is read instead of z."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.oscillator.integration.holds import compiled
from plant_sim.oscillator.integration.linear import lag
from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient
from rtctl.border.arrays import FloatArray

HERMITE: NDArray[np.float64] = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-3.0, -2.0, 3.0, -1.0], [2.0, 1.0, -2.0, 1.0]]
)
"""Matrix: coefficients of 1, s, s^2, s^3 from value and slope at s = 0 and s = 1."""


def lagging(moved: Moved, p: Values) -> Moved:
    """Return the reading behind a first-order lag, settled at first."""
    if p["time_constant"] == 0.0:
        return moved
    reading = behind(moved, p["time_constant"])
    slope = (moved.displacement - reading) / p["time_constant"]
    return moved._replace(displacement=reading, filtered_slope=slope)


def behind(moved: Moved, time_constant: float) -> FloatArray:
    """Return z (samples,) behind a lag that is settled at first; exact for the cubic through z and its slope."""
    z, slope = moved.displacement, moved.slope * moved.period_s
    ends = lag(moved.period_s / time_constant, 3).end
    out = np.empty_like(z)
    _follow(z, slope, 1.0 - ends[0], ends @ HERMITE, out)
    return out


@compiled
def _follow(z: Any, slope: Any, decay: float, w: Any, out: Any) -> None:
    """Set `out` to the lag's output at samples of `z`, from `z[0]` on; `slope` in z a sample."""
    y = z[0]
    out[0] = y
    for i in range(1, len(z)):
        y = decay * y + ((w[0] * z[i - 1] + w[1] * slope[i - 1]) + (w[2] * z[i] + w[3] * slope[i]))
        out[i] = y


MECHANISM = OscillatorMechanism(
    id="sensor.lag",
    statement="The sensor lags with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the reading behind the motion", lambda s: 1.0 / s.rate, low=0.0
        ),
    ),
    sensor=lagging,
    transfer=lambda s, p: 1.0 / (1.0 + p["time_constant"] * s),
    looks_between=True,
    stage=2,
)
