"""`friction.presliding`: - level h, displacement h' = z' - |z'| h (Dahl).

With F = level h and a contact of stiffness level / displacement that is F' = stiffness z' (1 - F / level sign z'), the
law of Bouc and Wen whose yielding does not depend on the sign of the force (bend = 0).

Reference: P. Dahl, A Solid Friction Model, Aerospace Corporation TOR-158(3107-18), 1968, eq. 4 with i = 1.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, Values, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def presliding(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: level, 1 / displacement; w: h, the force over its level, within -1 and 1."""
    return -p[row, j] * w[0], ((v - abs(v) * w[0]) * p[row + 1, j],)


def fastest_rate(p: Values, speed: float) -> float:
    """Return the faster rate of the contact as a spring before it slides and of its yielding."""
    return math.hypot((p["level"] / p["displacement"]) ** 0.5, RELAXATION * speed / p["displacement"])


MECHANISM = OscillatorMechanism(
    id="friction.presliding",
    statement="Dry friction of {level} builds up over a displacement of {displacement} at each turn (Dahl).",
    parameters=(
        coefficient("level", "{z}/s^2", "of the friction", lambda s: s.acceleration, low=0.0),
        shape(
            "displacement",
            "{z}",
            "over which it builds up: level over the contact's stiffness",
            lambda s: s.excursion,
            shape_range=(0.05, 2.0),
            grid=3,
        ),
    ),
    memory=Memory(presliding, 1, lambda p: (p["level"], 1.0 / p["displacement"])),
    fastest_rate=fastest_rate,
    generalises={"friction.coulomb": lambda p: {"level": p["level"]}},
)
