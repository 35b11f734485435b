"""`nonparametric.relaxations`: - level sum of (r_k time)^order w_k, w_k' = z' - r_k w_k, r_k = 4^k / time, k = -2 to 2.

A spring that relaxes over decades of time, as a polymer's does: with an order between 0 and 1 nearly the fractional
derivative of that order (Oldham and Spanier 1974); one relaxation alone is `stiffness.viscoelastic`.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, Values, coefficient, shape

APART = 4.0
"""Ratio of a rate to the next slower one."""
STEPS = (-2, -1, 0, 1, 2)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def relaxing(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rates; p: weight of each element [1/s^2], rate of the slowest [1/s]; w: elastic extensions."""
    rate = p[row + 5, j]
    force = p[row, j] * w[0] + p[row + 1, j] * w[1] + p[row + 2, j] * w[2]
    force += p[row + 3, j] * w[3] + p[row + 4, j] * w[4]
    return -force, (
        v - rate * w[0], v - 4.0 * rate * w[1], v - 16.0 * rate * w[2], v - 64.0 * rate * w[3],
        v - 256.0 * rate * w[4],
    )  # fmt: skip


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants in the law's order."""
    return (*(p["level"] * APART ** (k * p["order"]) for k in STEPS), APART ** STEPS[0] / p["time"])


MECHANISM = OscillatorMechanism(
    id="nonparametric.relaxations",
    statement="A part of the stiffness relaxes with many time constants, as of a polymer, not with one.",
    parameters=(
        coefficient("level", "1/s^2", "of the element in the middle", lambda s: s.rate**2),
        shape(
            "order", "dimensionless", "of the fractional derivative that it comes near", lambda s: 0.5,
            shape_range=(0.4, 1.6), low=0.02, grid=2,
        ),
        shape("time", "s", "of the element in the middle", lambda s: 1.0 / s.rate, shape_range=(1.0, 10.0), grid=1),
    ),
    memory=Memory(relaxing, len(STEPS), constants),
    fastest_rate=lambda p, speed: RELAXATION * APART ** STEPS[-1] / p["time"],
)  # fmt: skip
