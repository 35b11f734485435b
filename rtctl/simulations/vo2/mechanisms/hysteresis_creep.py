"""`hysteresis.creep`: phi + rate sum_j g_j (z_j - phi), t_j z_j' = phi - z_j, phi what the relays make.

After a change of temperature the phase fraction creeps on by `rate` of its change a decade of time, from `onset` until
`end`. t_j lie a third of a decade apart over that range, weighted so that the sum changes smoothly with both. The sum
of relaxations at equal logarithmic distances is Kuhnen and Janocha's creep operator of log t type.
"""

import math

import numpy as np

from rtctl.simulations.vo2.mechanism import FloatArray, Read, Values, Vo2Mechanism, coefficient, shape
from rtctl.simulations.vo2.relaxation import behind

A_DECADE = 3
"""Relaxations a decade of time."""
DECADES = 6
"""The grid of relaxations begins at `onset` and goes so far."""


def weights(decades: float) -> list[float]:
    """Of the relaxations 10^(j / A_DECADE) onset, j = 0, 1, ..., for a creep of so many decades: 1 up to its end."""
    width = max(decades, 0.0) * A_DECADE
    found = [min(1.0, max(0.0, width + 1.0 - j)) for j in range(A_DECADE * DECADES + 1)]
    return [one / A_DECADE for one in found if one > 0.0]


def creeping(read: Read, p: Values) -> Read:
    """Both read-outs creep, each with its own relays."""
    share = np.array(weights(math.log10(max(p["end"] / p["onset"], 1.0))))
    taus = p["onset"] * 10.0 ** (np.arange(len(share)) / A_DECADE)

    def missing(relays: FloatArray) -> FloatArray:
        return p["rate"] * behind(relays, read.steps_s, taus, share)

    return read._replace(
        reading=read.reading + missing(read.resistance_relays),
        deflection=read.deflection + missing(read.deflection_relays),
    )


MECHANISM = Vo2Mechanism(
    id="hysteresis.creep",
    statement="At constant temperature the transition creeps on, by {rate} of its change a decade of time, from "
    "{onset} to {end}.",
    parameters=(
        coefficient("rate", "dimensionless", "of the change, a decade", 0.05, low=-0.5, high=2.0),
        shape("onset", "s", "of the creep", 0.01, default=0.01, searched=True, low=1e-5, high=1e3,
              shape_range=(0.03, 100.0)),
        shape("end", "s", "of the creep", 1.0, default=10.0, searched=True, low=1e-5, high=1e4,
              shape_range=(0.03, 10.0)),
    ),
    film=creeping,
)  # fmt: skip
