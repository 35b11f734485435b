"""`stiffness.clearance`: the spring is stretched by e = z - clip(z, low, high) alone, not by z.

low and high are gap (centre - 1) and gap (centre + 1): within them there is no force. Of every order of the spring
(stiffness, quadratic, cubic, quintic), since free play belongs to the joint and not to one of them.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.terms import CUBIC, QUADRATIC, QUINTIC, STIFFNESS
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape

TINY = 1e-100
"""Half of a step of no length, in any unit: where the motion turns, the mean is the value."""


@law
def secant(z: float, e: float, p: Any, j: int) -> Any:
    """Return (f(z) - f(e)) / (z - e) of the spring's force f = stiffness z + quadratic z^2 + ..., without dividing."""
    product, squares = z * e, z * z + e * e
    stiffness = p[STIFFNESS, j] + p[QUADRATIC, j] * (z + e) + p[CUBIC, j] * (squares + product)
    return stiffness + p[QUINTIC, j] * (squares * (squares + product) - product * product)


@law
def mean_beyond(z: float, half: float, inverse: float) -> Any:
    """Return the mean of max(x, 0) for x from `z - half` to `z + half`; half > 0, `inverse` is 1 / half."""
    inside = min(max(z * inverse + 1.0, 0.0), 2.0)
    return max(z - half, 0.0) + 0.25 * half * (inside * inside)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def loose(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: low, high, step of the integrator; w: one state, which a law must have.

    Play is often crossed within a step, and an integrator that looks at instants alone hardly sees it. So the part of
    the displacement that is free, low + beyond(z - low) - beyond(z - high), is its mean over a step about `z`.
    """
    half = 0.5 * abs(v) * p[row + 2, j] + TINY
    low, high = p[row, j], p[row + 1, j]
    inverse = 1.0 / half
    free = low + (mean_beyond(z - low, half, inverse) - mean_beyond(z - high, half, inverse))
    return free * secant(z, z - free, p, j), (0.0 * z,)


def constants(p: Values) -> tuple[float, ...]:
    """Return the ends of the play, and the place of the integrator's step."""
    return p["gap"] * (p["centre"] - 1.0), p["gap"] * (p["centre"] + 1.0), 0.0


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
    memory=Memory(loose, 1, constants, step=2),
)  # fmt: skip
