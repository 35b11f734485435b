"""`damping.power`: - level |z' / speed|^exponent sign z', 1 < exponent <= 3.

At an exponent of 1 it is the linear damping of the nominal model, at 2 `damping.quadratic`. Below 1 the force has an
infinite slope at rest and no data tell it from dry beside linear damping: dry friction and its smooth forms are there.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, Values, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def slowed(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: level, 1 / speed, exponent - 1; w: one state, which a law must have and none needs."""
    x = v * p[row + 1, j]
    return -p[row, j] * x * abs(x) ** p[row + 2, j], (0.0 * z,)


def fastest_rate(p: Values, speed: float) -> float:
    """Return the rate of the damping at the largest speed."""
    steepening: float = (speed / p["speed"]) ** (p["exponent"] - 1.0)
    return RELAXATION * p["level"] * p["exponent"] * steepening / p["speed"]


MECHANISM = OscillatorMechanism(
    id="damping.power",
    statement="The damping force grows with the power {exponent} of the speed; it is {level} at {speed}.",
    parameters=(
        coefficient("level", "{z}/s^2", "of the force at `speed`", lambda s: s.acceleration, low=0.0),
        shape(
            "exponent",
            "dimensionless",
            "of the speed, from 1 to 3",
            lambda s: 1.0,
            low=1.0,
            high=3.0,
            shape_range=(1.2, 3.0),
            grid=3,
        ),
        shape("speed", "{z}/s", "at which `level` is the force", lambda s: s.velocity, redundant=True),
    ),
    memory=Memory(slowed, 1, lambda p: (p["level"], 1.0 / p["speed"], p["exponent"] - 1.0)),
    fastest_rate=fastest_rate,
    generalises={"damping.quadratic": lambda p: {"coefficient": p["level"] / p["speed"] ** 2}},
)
