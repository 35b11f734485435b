"""`stop.one_sided`: - above (z - place) where z > place, or - below (z - place) where z < place: an elastic stop."""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import MOST_OF_A_STOP, Memory, OscillatorMechanism, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def stopped(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: above, below [1/s^2], place; w: one state, which a law must have and none needs."""
    beyond = z - p[row + 2, j]
    return -p[row, j] * max(beyond, 0.0) - p[row + 1, j] * min(beyond, 0.0), (0.0 * z,)


MECHANISM = OscillatorMechanism(
    id="stop.one_sided",
    statement="An elastic stop at {place} adds a stiffness of {above} above it, of {below} below it.",
    forms={
        "above": "An elastic stop adds a stiffness of {above} where the displacement is above {place}.",
        "below": "An elastic stop adds a stiffness of {below} where the displacement is below {place}.",
    },
    parameters=(
        coefficient(
            "above", "1/s^2", "of a stop on the upper side", lambda s: s.rate**2, default=0.0, low=0.0,
            reach=MOST_OF_A_STOP,
        ),
        coefficient(
            "below", "1/s^2", "of a stop on the lower side", lambda s: s.rate**2, default=0.0, low=0.0,
            reach=MOST_OF_A_STOP,
        ),
        shape(
            "place", "{z}", "where it begins", lambda s: s.excursion, low=-math.inf,
            quantiles={"above": (0.4, 0.6, 0.75, 0.88, 0.96, 0.997), "below": (0.003, 0.04, 0.12, 0.25, 0.4, 0.6)},
        ),
    ),
    memory=Memory(stopped, 1, lambda p: (p["above"], p["below"], p["place"])),
    fastest_rate=lambda p, speed: math.sqrt(max(p["above"], p["below"])),
)  # fmt: skip
