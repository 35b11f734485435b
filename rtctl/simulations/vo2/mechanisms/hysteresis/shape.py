"""`hysteresis.shape`: each read-out + (first + side branch) sin(pi x) + (second + side_second branch) sin(2 pi x).

x is the surrogate in parts of the range at identification; branch goes from -1, cooling, to 1, heating, over a tenth
of that range after a reversal. Corrections are smooth and vanish at both ends, where the loops are closed.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel
from rtctl.border.mechanisms import Parameter, Scales
from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient

RADIUS = 0.05


@kernel
def branch_centre(centre: float, x: float, radius: float) -> float:
    """Return the centre of a play of this radius after x."""
    return min(max(centre, x - radius), x + radius)


@background_kernel
def branch_of(x: FloatArray, radius: float) -> FloatArray:
    """Return the position (n,) from -1 to 1 of x in a play of this radius, heated from cold."""
    branch = np.empty_like(x)
    centre = x[0] - radius
    for k in range(x.size):
        centre = branch_centre(centre, x[k], radius)
        branch[k] = (x[k] - centre) / radius
    return branch


def refined(read: Read, p: Values) -> Read:
    """Add the corrections to the loops."""
    x = np.clip((read.surrogate - read.span.low) / read.span.width, 0.0, 1.0)
    branch = branch_of(x, RADIUS)
    once, twice = np.sin(math.pi * x), np.sin(2.0 * math.pi * x)

    def correction(of: str) -> FloatArray:
        found: FloatArray = (p[f"{of}_first"] + p[f"{of}_side"] * branch) * once
        found += (p[f"{of}_second"] + p[f"{of}_side_second"] * branch) * twice
        return found

    return read._replace(
        reading=read.reading - correction("resistance"), deflection=read.deflection + correction("deflection")
    )


def _parameters(
    of: str, unit: str, what: str, scale: float | Callable[[Scales], float]
) -> tuple[Parameter, ...]:
    terms = {
        "first": "in the middle of the range", "second": "below the middle, and against it above",
        "side": "of heating, against it of cooling", "side_second": "of heating, below the middle",
    }  # fmt: skip
    return tuple(
        coefficient(f"{of}_{name}", unit, f"of the {what}, {where}", scale, default=0.0)
        for name, where in terms.items()
    )


MECHANISM = Vo2Mechanism(
    id="hysteresis.shape",
    of_identification=True,
    statement="The static loops are modelled too coarsely: in their middle by {deflection_first} and {deflection_side} "
    "(heating) of the deflection, {resistance_first} and {resistance_side} of the logarithm of the resistance.",
    parameters=(
        *_parameters("resistance", "dimensionless", "logarithm of the resistance", 0.3),
        *_parameters("deflection", "um", "deflection", lambda s: 0.3 * s.excursion),
    ),
    film=refined,
)
