"""`nonparametric.dissipation`: - sum of c_n |z'|^n sign z' for n = 1/4, 1/2, 2 and 3, a damping of any power."""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient

POWERS = {"quarter": 0.25, "half": 0.5, "square": 2.0, "cube": 3.0}


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def slowed(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: the coefficients; w: one state, which a law must have and none needs."""
    speed = abs(v)
    root = math.sqrt(speed)
    force = p[row, j] * math.sqrt(root) + p[row + 1, j] * root
    force += speed * speed * (p[row + 2, j] + speed * p[row + 3, j])
    return force if v < 0.0 else -force, (0.0 * z,)


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants in the law's order."""
    return tuple(p[name] for name in POWERS)


MECHANISM = OscillatorMechanism(
    id="nonparametric.dissipation",
    statement="The damping force grows with another power of the speed than dry friction, a viscous or a fluid one.",
    parameters=tuple(
        coefficient(
            name, f"{{z}}^{1.0 - n:g}*s^{n - 2.0:g}", f"of |z'|^{n:g}",
            lambda s, n=n: s.acceleration / s.velocity**n,
        )
        for name, n in POWERS.items()
    ),
    memory=Memory(slowed, 1, constants),
)  # fmt: skip
