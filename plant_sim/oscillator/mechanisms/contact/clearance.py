"""`stiffness.clearance`: the spring is stretched by e = z - clip(z, low, high) alone, not by z.

low and high are gap (centre - 1) and gap (centre + 1): within them there is no force. Of every order of the spring
(stiffness, quadratic, cubic, quintic), since free play belongs to the joint and not to one of them.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.terms import CUBIC, QUADRATIC, QUINTIC, STIFFNESS
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape


@law
def secant(z: float, e: float, p: Any, j: int) -> Any:
    """Return (f(z) - f(e)) / (z - e) of the spring's force f = stiffness z + quadratic z^2 + ..., without a division."""
    product, squares = z * e, z * z + e * e
    stiffness = p[STIFFNESS, j] + p[QUADRATIC, j] * (z + e) + p[CUBIC, j] * (squares + product)
    return stiffness + p[QUINTIC, j] * (squares * (squares + product) - product * product)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def loose(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: low, high; w: one state, which a law must have and none needs."""
    free = min(max(z, p[row, j]), p[row + 1, j])
    return free * secant(z, z - free, p, j), (0.0 * z,)


def constants(p: Values) -> tuple[float, ...]:
    """Return the ends of the play."""
    return p["gap"] * (p["centre"] - 1.0), p["gap"] * (p["centre"] + 1.0)


MECHANISM = OscillatorMechanism(
    id="stiffness.clearance",
    statement="The spring has free play: it gives no force within {gap} to either side of the middle of its play.",
    parameters=(
        coefficient(
            "gap", "{z}", "half of the free play", lambda s: s.excursion, low=0.0, kinked=True,
        ),
        shape(
            "centre", "dimensionless", "middle of the play over gap; 0 is half of the play to either side",
            lambda s: 1.0, default=0.0, low=-1.0, high=1.0, shape_range=(0.0, 1.0),
        ),
    ),
    memory=Memory(loose, 1, constants),
)  # fmt: skip
