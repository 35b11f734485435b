"""`stiffness.drift`: - rate d (1 - exp(-t / d)) z, t from the record's first sample.

d is the settling time; without one the force is - rate t z.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.elementary import fading
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient
from rtctl.border.mechanisms import FIRST_RATE, STEADY, settling_time


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def warming(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: stiffness when settled, 1 / settling time; w: one state, which a law must have."""
    return -p[row, j] * (1.0 - fading(t * p[row + 1, j])) * z, (0.0 * z,)


def settles(p: Values) -> bool:
    """Return whether the drift comes to an end."""
    return p["settling_time"] != STEADY


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants of `warming`, which does nothing in a lane with a steady drift."""
    return (p["rate"] * p["settling_time"], 1.0 / p["settling_time"]) if settles(p) else (0.0, 0.0)


MECHANISM = OscillatorMechanism(
    id="stiffness.drift",
    statement="The stiffness drifts by {rate} from the start of each record.",
    forms={
        "settling_time": "The stiffness drifts by {rate} at the start of each record and settles with a time constant "
        "of {settling_time}."
    },
    parameters=(
        coefficient(
            "rate",
            "1/s^3",
            "of the stiffness",
            lambda s: s.acceleration / (s.displacement * s.duration),
            reach=FIRST_RATE,
        ),
        settling_time(),
    ),
    terms={"drift": lambda p: 0.0 if settles(p) else p["rate"]},
    memory=Memory(warming, 1, constants, acts=settles),
    fastest_rate=lambda p, speed: math.sqrt(abs(p["rate"]) * p["settling_time"]),
    in_steady_state=False,
)
