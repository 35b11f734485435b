"""`damping.power`: - level |z' / speed|^exponent sign z', 0 < exponent <= 3.

At an exponent of 1 it is the linear damping of the nominal model, at 2 `damping.quadratic`; towards 0 it becomes
`friction.coulomb`. Below 1 the force would have an infinite slope at rest; it is smooth there:

    - level x (x^2 + SMOOTH^2)^((exponent - 1) / 2),   x = z' / speed
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.elementary import power
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, Values, coefficient, shape

SMOOTH = 1e-3
"""Speed over `speed`, below which a force with an exponent below 1 is linear in it."""


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def slowed(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: level, 1 / speed, (exponent - 1) / 2, smooth part squared; w: an unused state."""
    x = v * p[row + 1, j]
    return -p[row, j] * x * power(x * x + p[row + 3, j], p[row + 2, j]), (0.0 * z,)


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants of the law."""
    square = SMOOTH**2 if p["exponent"] < 1.0 else 0.0
    return p["level"], 1.0 / p["speed"], 0.5 * (p["exponent"] - 1.0), square


def fastest_rate(p: Values, speed: float) -> float:
    """Return the rate of the damping where it is steepest: at the largest speed, or below an exponent of 1 at rest."""
    where = SMOOTH if p["exponent"] < 1.0 else speed / p["speed"]
    rate: float = (
        RELAXATION * p["level"] * max(p["exponent"], 1.0) * where ** (p["exponent"] - 1.0) / p["speed"]
    )
    return rate


MECHANISM = OscillatorMechanism(
    id="damping.power",
    statement="The damping force grows with the power {exponent} of the speed; it is {level} at {speed}.",
    parameters=(
        coefficient("level", "{z}/s^2", "of the force at `speed`", lambda s: s.acceleration, low=0.0),
        shape(
            "exponent",
            "dimensionless",
            "of the speed, above 0, up to 3",
            lambda s: 1.0,
            low=0.1,
            high=3.0,
            shape_range=(0.3, 3.0),
            grid=4,
        ),
        shape("speed", "{z}/s", "at which `level` is the force", lambda s: s.velocity, redundant=True),
    ),
    memory=Memory(slowed, 1, constants),
    fastest_rate=fastest_rate,
    generalises={"damping.quadratic": lambda p: {"coefficient": p["level"] / p["speed"] ** 2}},
)
