"""`sensor.lag`: y with time_constant y' = z - y is read instead of z."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant_sim.oscillator.integration.holds import compiled
from plant_sim.oscillator.integration.linear import lag
from plant_sim.oscillator.kinks import Pieces, pieces
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
    z = moved.displacement
    if moved.kinks is None:
        slope = moved.slope * moved.period_s
        its = Pieces(z[:-1], slope[:-1], z[1:], slope[1:])
    else:
        its = pieces(z, moved.kinks)
    ends = lag(moved.period_s / time_constant, 3).end
    out = np.empty_like(z)
    out[0] = z[0]
    _follow(*its, 1.0 - ends[0], ends @ HERMITE, out)
    return out


# 7 parameters because a kernel takes its arrays one by one
@compiled
def _follow(  # noqa: PLR0913
    start: Any, start_slope: Any, end: Any, end_slope: Any, decay: float, w: Any, out: Any
) -> None:
    """Set `out` (n,) to the lag's output behind n - 1 intervals, from `out[0]` on; slopes per interval."""
    y = out[0]
    for i in range(len(start)):
        y = decay * y + ((w[0] * start[i] + w[1] * start_slope[i]) + (w[2] * end[i] + w[3] * end_slope[i]))
        out[i + 1] = y


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
