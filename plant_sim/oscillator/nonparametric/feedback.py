"""`nonparametric.feedback`: - early y_12 - late y_24, where y_k is the displacement after k all-pass sections.

Each section, x' = (y_(k-1) - x) / time and y_k = 2 x - y_(k-1), leaves amplitudes as they are and is late by up to a
radian of the motion: two of the sums stand, near a resonance, for a force of any phase that comes late.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, Values, coefficient, shape

SECTIONS = 24


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def fed_back(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rates; p: early, late [1/s^2], rate of a section [1/s]; w: x of each section."""
    rate = p[row + 2, j]
    y1 = 2.0 * w[0] - z
    y2 = 2.0 * w[1] - y1
    y3 = 2.0 * w[2] - y2
    y4 = 2.0 * w[3] - y3
    y5 = 2.0 * w[4] - y4
    y6 = 2.0 * w[5] - y5
    y7 = 2.0 * w[6] - y6
    y8 = 2.0 * w[7] - y7
    y9 = 2.0 * w[8] - y8
    y10 = 2.0 * w[9] - y9
    y11 = 2.0 * w[10] - y10
    y12 = 2.0 * w[11] - y11
    y13 = 2.0 * w[12] - y12
    y14 = 2.0 * w[13] - y13
    y15 = 2.0 * w[14] - y14
    y16 = 2.0 * w[15] - y15
    y17 = 2.0 * w[16] - y16
    y18 = 2.0 * w[17] - y17
    y19 = 2.0 * w[18] - y18
    y20 = 2.0 * w[19] - y19
    y21 = 2.0 * w[20] - y20
    y22 = 2.0 * w[21] - y21
    y23 = 2.0 * w[22] - y22
    y24 = 2.0 * w[23] - y23
    return -(p[row, j] * y12 + p[row + 1, j] * y24), (
        rate * (z - w[0]), rate * (y1 - w[1]), rate * (y2 - w[2]), rate * (y3 - w[3]), rate * (y4 - w[4]),
        rate * (y5 - w[5]), rate * (y6 - w[6]), rate * (y7 - w[7]), rate * (y8 - w[8]), rate * (y9 - w[9]),
        rate * (y10 - w[10]), rate * (y11 - w[11]), rate * (y12 - w[12]), rate * (y13 - w[13]), rate * (y14 - w[14]),
        rate * (y15 - w[15]), rate * (y16 - w[16]), rate * (y17 - w[17]), rate * (y18 - w[18]), rate * (y19 - w[19]),
        rate * (y20 - w[20]), rate * (y21 - w[21]), rate * (y22 - w[22]), rate * (y23 - w[23]),
    )  # fmt: skip


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants in the law's order."""
    return p["early"], p["late"], 1.0 / p["time"]


MECHANISM = OscillatorMechanism(
    id="nonparametric.feedback",
    statement="A force follows the motion late, as of a loop around the device.",
    parameters=(
        coefficient("early", "1/s^2", "of the force that is half as late", lambda s: s.rate**2, default=0.0),
        coefficient("late", "1/s^2", "of the force that is latest", lambda s: s.rate**2, default=0.0),
        shape("time", "s", "of each of 24 sections", lambda s: 1.0 / s.rate, shape_range=(0.1, 1.2), grid=6),
    ),
    memory=Memory(fed_back, SECTIONS, constants, start=lambda z, v: (z,) * SECTIONS),
    fastest_rate=lambda p, speed: RELAXATION / p["time"],
)  # fmt: skip
