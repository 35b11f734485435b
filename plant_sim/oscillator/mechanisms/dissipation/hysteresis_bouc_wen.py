"""`hysteresis.bouc_wen`: - level h, displacement h' = z' - loop |z'| |h|^(order - 1) h - bend z' |h|^order.

Source: Y. K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976).
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.elementary import power
from plant_sim.oscillator.mechanism import (
    RELAXATION,
    Memory,
    OscillatorMechanism,
    Values,
    coefficient,
    shape,
)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def hysteretic(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: level, 1 / displacement, loop, bend, order; w: h.

    |h|^order stays within 1 / (loop + bend).
    """
    h = w[0]
    size = power(abs(h), p[row + 4, j])
    rate = v - p[row + 2, j] * abs(v) * (size if h > 0.0 else -size) - p[row + 3, j] * v * size
    return -p[row, j] * h, (rate * p[row + 1, j],)


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def of_first_order(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return the same where order is 1, in arithmetic that the compiler works on for several lanes at once."""
    h = w[0]
    rate = v - p[row + 2, j] * abs(v) * h - p[row + 3, j] * v * abs(h)
    return -p[row, j] * h, (rate * p[row + 1, j],)


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants of both laws."""
    return (p["level"], 1.0 / p["displacement"], p["loop"], p["bend"], p["order"])


def fastest_rate(p: Values, speed: float) -> float:
    """Return the faster rate of the spring before it yields and of the yielding."""
    yielding = max(p["order"], 1.0) * (p["loop"] + abs(p["bend"])) * speed / p["displacement"]
    return math.hypot((p["level"] / p["displacement"]) ** 0.5, RELAXATION * yielding)


MECHANISM = OscillatorMechanism(
    id="hysteresis.bouc_wen",
    statement="A hysteretic force of up to {level} yields over {displacement} (Bouc and Wen).",
    parameters=(
        coefficient("level", "{z}/s^2", "of the hysteretic force", lambda s: s.acceleration, low=0.0),
        shape(
            "displacement",
            "{z}",
            "over which the force yields",
            lambda s: s.excursion,
            shape_range=(0.1, 3.0),
        ),
        shape(
            "loop",
            "dimensionless",
            "share of yielding that makes the loop",
            lambda s: 0.5,
            default=0.5,
            redundant=True,
        ),
        shape(
            "bend",
            "dimensionless",
            "share that bends it",
            lambda s: 0.5,
            default=0.5,
            low=-10.0,
            shape_range=(0.1, 3.0),
            also=(-0.5,),
        ),
        shape(
            "order",
            "dimensionless",
            "of the yielding: large where it sets in at once",
            lambda s: 1.0,
            default=1.0,
            low=0.5,
            high=10.0,
            shape_range=(0.5, 3.0),
        ),
    ),
    memory=Memory(hysteretic, 1, constants, simpler=of_first_order, is_simple=lambda p: p["order"] == 1.0),
    fastest_rate=fastest_rate,
    generalises={
        "friction.presliding": lambda p: {
            "level": p["level"] / (p["loop"] + max(p["bend"], 0.0)),
            "displacement": p["displacement"] / (p["loop"] + max(p["bend"], 0.0)),
        }
    },
)
