"""`stiffness.viscoelastic`: - stiffness w, where w' = z' - w / time_constant (a Maxwell element beside the spring)."""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def relaxing(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rate; p: stiffness [1/s^2], 1 / time constant [1/s]; w: the element's elastic extension."""
    return -p[row, j] * w[0], (v - p[row + 1, j] * w[0],)


MECHANISM = OscillatorMechanism(
    id="stiffness.viscoelastic",
    statement="A part of the stiffness, {stiffness}, relaxes with a time constant of {time_constant}.",
    parameters=(
        coefficient("stiffness", "1/s^2", "of the relaxing part", lambda s: s.rate**2, low=0.0),
        shape("time_constant", "s", "of the relaxation", lambda s: 1.0 / s.rate),
    ),
    memory=Memory(relaxing, 1, lambda p: (p["stiffness"], 1.0 / p["time_constant"])),
    fastest_rate=lambda p, speed: math.hypot(p["stiffness"] ** 0.5, RELAXATION / p["time_constant"]),
)
