"""`nonparametric.stop`: - above (z - place) beyond place, - below (z + place) beyond -place: a spring with a kink."""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def stopped(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: above, below [1/s^2], place; w: one state, which a law must have and none needs."""
    place = p[row + 2, j]
    force = 0.0 * z
    if z > place:
        force = -p[row, j] * (z - place)
    elif z < -place:
        force = -p[row + 1, j] * (z + place)
    return force, (0.0 * z,)


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants in the law's order."""
    return p["above"], p["below"], p["place"]


def fastest_rate(p: Values, speed: float) -> float:
    """Return the rate against the stiffer side."""
    return math.sqrt(max(p["above"], p["below"], 0.0))


MECHANISM = OscillatorMechanism(
    id="nonparametric.stop",
    statement="The restoring force has a kink, as of a stop or of play that is used up, {place} from the origin.",
    parameters=(
        coefficient("above", "1/s^2", "beyond the place", lambda s: s.rate**2, default=0.0),
        coefficient("below", "1/s^2", "beyond it on the other side", lambda s: s.rate**2, default=0.0),
        shape(
            "place", "{z}", "of the kink, from the origin", lambda s: s.displacement, shape_range=(0.5, 2.5),
            grid=6,
        ),
    ),
    memory=Memory(stopped, 1, constants),
    fastest_rate=fastest_rate,
)  # fmt: skip
