"""`stiffness.gravity`: - coefficient (radian sin(z / radian) - z), radian the displacement of an angle of one radian.

The sine without its linear part, which is in the nominal stiffness: that is the stiffness of small swings, and a
pendulum with nothing but gravity has coefficient = stiffness. So the two are not nearly collinear where swings are
small, and 0 is the nominal model. Below 0 the pendulum is upright on a spring.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.equation.sine import sine
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def swinging(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: coefficient, radian, 1 / radian; w: one state, which a law must have."""
    return p[row, j] * (z - p[row + 1, j] * sine(z * p[row + 2, j])), (0.0 * z,)


def fastest_rate(p: Values, speed: float) -> float:
    """Return what the force adds to the stiffness at most: up to twice its coefficient where it is upright."""
    return math.sqrt(max(p["coefficient"], -2.0 * p["coefficient"]))


MECHANISM = OscillatorMechanism(
    id="stiffness.gravity",
    statement="The restoring force has the sine of the angle in it, as a pendulum's: gravity of {coefficient}.",
    parameters=(
        coefficient("coefficient", "1/s^2", "of the sine of the angle, in the restoring force", lambda s: s.rate**2),
        shape(
            "radian", "{z}", "displacement of an angle of one radian; where z is an angle it is known",
            lambda s: s.displacement, default=1.0, default_unit="rad", redundant=True,
        ),
    ),
    memory=Memory(swinging, 1, lambda p: (p["coefficient"], p["radian"], 1.0 / p["radian"])),
    fastest_rate=fastest_rate,
)  # fmt: skip
