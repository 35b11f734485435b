"""`hysteresis.creep`: phi + rate sum_j g_j (z_j - phi), t_j z_j' = phi - z_j, phi the switched share.

After a change of temperature the phase fraction creeps on by `rate` of its change a decade of time, from `onset` until
`end`. t_j lie a third of a decade apart over that range, weighted so that the sum changes smoothly with both. The sum
of relaxations at equal logarithmic distances is Kuhnen and Janocha's creep operator of log t type. What the pure phases
do at once is in `rtctl.simulations.vo2.phases`.
"""

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.simulations.vo2.mechanism import (
    PURE_PHASES,
    Read,
    Values,
    Vo2Mechanism,
    coefficient,
    heating_times,
    shape,
)
from rtctl.simulations.vo2.phases import mixed_along, switched_along
from rtctl.simulations.vo2.relaxation import behind

A_DECADE = 3
"""Relaxations per decade of time."""
DECADES = 6
"""Decades of time that the grid of relaxations covers from `onset` on."""


def weights(decades: float) -> list[float]:
    """Return weights of the relaxations 10^(j / A_DECADE) onset, j = 0, 1, ..., for a creep over so many decades."""
    width = max(decades, 0.0) * A_DECADE
    found = [min(1.0, max(0.0, width + 1.0 - j)) for j in range(A_DECADE * DECADES + 1)]
    return [one / A_DECADE for one in found if one > 0.0]


def creeping(read: Read, p: Values) -> Read:
    """Let both read-outs creep, each with its own share; the pure phases do not."""
    weight = np.array(weights(math.log10(max(p["end"] / p["onset"], 1.0))))
    taus = p["onset"] * 10.0 ** (np.arange(len(weight)) / A_DECADE)
    film, T = read.phases.of(p), read.temperature

    def missing(share: FloatArray) -> FloatArray:
        return p["rate"] * behind(share, read.steps_s, taus, weight)

    phi = switched_along(read.reading, T, film)
    return read._replace(
        reading=mixed_along(phi + missing(phi), T, film),
        deflection=read.deflection + missing(read.deflection + p["expansion"] * T),
    )


MECHANISM = Vo2Mechanism(
    id="hysteresis.creep",
    statement="At constant temperature the transition creeps on, by {rate} of its change a decade of time, from "
    "{onset} to {end}.",
    parameters=(
        coefficient("rate", "dimensionless", "of the change, a decade", 0.05, low=-0.5, high=2.0),
        shape("onset", "s", "of the creep", heating_times(5.0), default=0.01, searched=True, low=1e-5, high=1e3,
              shape_range=(0.03, 100.0)),
        shape("end", "s", "of the creep", lambda s: s.duration, default=10.0, searched=True, low=1e-5, high=1e4,
              shape_range=(0.03, 3.0)),
        *PURE_PHASES,
    ),
    film=creeping,
    stage=2,
    slow=True,
)  # fmt: skip
