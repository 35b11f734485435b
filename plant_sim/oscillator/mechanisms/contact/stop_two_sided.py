"""`stop.two_sided`: - stiffness (z - upper + tau z') where z > upper, - stiffness (z - lower + tau z') where z < lower.

tau is the retardation time of both, as of `stop.one_sided`.
With one place beyond the motion it is `stop.one_sided`; beside a spring of no stiffness, `stiffness.clearance`.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape
from plant_sim.oscillator.mechanisms.contact.stops import (
    DAMPER,
    MOST_OF_A_STOP,
    rate_of_a_stop,
    retardation_time,
)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def between(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: stiffness, lower, upper; w: one state, which a law must have and none needs."""
    beyond = max(z - p[row + 2, j], 0.0) + min(z - p[row + 1, j], 0.0)
    return -p[row, j] * beyond, (0.0 * z,)


@law
def damping(z: float, p: Any, row: int, j: int) -> Any:
    """Return impulse [z/s] and damping [1/s]; p as in `between`, then tau [s]."""
    beyond = max(z - p[row + 2, j], 0.0) + min(z - p[row + 1, j], 0.0)
    acting = p[row + 3, j] * p[row, j]
    return acting * beyond, acting if beyond != 0.0 else 0.0


def as_clearance(p: Values) -> Values:
    """Return the free play between the stops, of which the middle over no play at all is 0."""
    gap, middle = 0.5 * (p["upper"] - p["lower"]), 0.5 * (p["upper"] + p["lower"])
    return {"gap": gap, "centre": middle / gap if gap else 0.0}


def as_nearer_stop(p: Values) -> dict[str, float]:
    """Return the parameters of the one of both stops that is nearer to the rest."""
    side, place = ("below", "lower") if abs(p["lower"]) < abs(p["upper"]) else ("above", "upper")
    return {side: p["stiffness"], "place": p[place], "retardation_time": p["retardation_time"]}


MECHANISM = OscillatorMechanism(
    id="stop.two_sided",
    statement="Two stops add a stiffness of {stiffness} below {lower} and above {upper}.",
    supplements={"retardation_time": DAMPER},
    parameters=(
        coefficient(
            "stiffness", "1/s^2", "of each stop", lambda s: s.rate**2, low=0.0, reach=MOST_OF_A_STOP,
        ),
        shape(
            "lower", "{z}", "where the lower one begins", lambda s: s.excursion, low=-math.inf,
            quantiles={"": (0.003, 0.05, 0.18, 0.4)},
        ),
        shape(
            "upper", "{z}", "where the upper one begins", lambda s: s.excursion, low=-math.inf,
            quantiles={"": (0.6, 0.82, 0.95, 0.997)},
        ),
        retardation_time("both stops"),
    ),
    generalises={
        "stop.one_sided": as_nearer_stop,
        "stiffness.clearance": as_clearance,
    },
    memory=Memory(
        between, 1, lambda p: (p["stiffness"], p["lower"], p["upper"], p["retardation_time"]),
        damping=damping, simpler=between, is_simple=lambda p: p["retardation_time"] == 0.0,
    ),
    fastest_rate=lambda p, speed: rate_of_a_stop(p["stiffness"], p["retardation_time"]),
)  # fmt: skip
