"""`nonparametric.spring`: - sum of c_m z^m for m = 2 to 7, a restoring force of any shape."""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient

POWERS = (2, 3, 4, 5, 6, 7)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def bent(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: c_2 to c_7; w: one state, which a law must have and none needs."""
    high = p[row + 3, j] + z * (p[row + 4, j] + z * p[row + 5, j])
    return -(z * z) * (p[row, j] + z * (p[row + 1, j] + z * (p[row + 2, j] + z * high))), (0.0 * z,)


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants in the law's order."""
    return tuple(p[f"power_{m}"] for m in POWERS)


MECHANISM = OscillatorMechanism(
    id="nonparametric.spring",
    statement="The restoring force is no polynomial of the third or fifth order, but of another shape.",
    parameters=tuple(
        coefficient(
            f"power_{m}",
            f"1/({{z}}^{m - 1}*s^2)",
            f"of z^{m}",
            lambda s, m=m: s.rate**2 / s.displacement ** (m - 1),
        )
        for m in POWERS
    ),
    memory=Memory(bent, 1, constants),
)
