"""`stop.one_sided`: - above (z - place + tau z') where z > place, or - below (...) where z < place.

A spring and a damper side by side (Kelvin, Voigt) of the retardation time tau; without it the stop is elastic.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, coefficient, shape
from plant_sim.oscillator.mechanisms.contact.stops import (
    DAMPER,
    MOST_OF_A_STOP,
    rate_of_a_stop,
    retardation_time,
)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def stopped(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: above, below [1/s^2], place; w: one state, which a law must have and none needs."""
    beyond = z - p[row + 2, j]
    return -p[row, j] * max(beyond, 0.0) - p[row + 1, j] * min(beyond, 0.0), (0.0 * z,)


@law
def damping(z: float, p: Any, row: int, j: int) -> Any:
    """Return impulse [z/s] and damping [1/s]; p as in `stopped`, then tau [s]."""
    beyond = z - p[row + 2, j]
    stiffness = p[row, j] if beyond > 0.0 else p[row + 1, j]
    acting = p[row + 3, j] * stiffness
    return acting * beyond, acting


MECHANISM = OscillatorMechanism(
    id="stop.one_sided",
    statement="A stop at {place} adds a stiffness of {above} above it, of {below} below it.",
    forms={
        "above": "A stop adds a stiffness of {above} where the displacement is above {place}.",
        "below": "A stop adds a stiffness of {below} where the displacement is below {place}.",
    },
    supplements={"retardation_time": DAMPER},
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
        retardation_time("the stop"),
    ),
    memory=Memory(
        stopped, 1, lambda p: (p["above"], p["below"], p["place"], p["retardation_time"]),
        damping=damping, simpler=stopped, is_simple=lambda p: p["retardation_time"] == 0.0,
    ),
    fastest_rate=lambda p, speed: rate_of_a_stop(max(p["above"], p["below"]), p["retardation_time"]),
)  # fmt: skip
