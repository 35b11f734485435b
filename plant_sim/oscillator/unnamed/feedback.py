"""`unnamed.feedback`: - early y_4 - late y_8, where y_k is the displacement after k all-pass sections.

Each section, x' = (y_(k-1) - x) / time and y_k = 2 x - y_(k-1), leaves amplitudes as they are and is late by up to a
radian of the motion: two of the sums stand, near a resonance, for a force of any phase that comes late.
"""

from __future__ import annotations

from typing import Any

from plant_sim.oscillator.binding import law
from plant_sim.oscillator.mechanism import RELAXATION, Memory, OscillatorMechanism, Values, coefficient, shape

SECTIONS = 8


@law
def fed_back(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:
    """p: early, late [1/s^2], rate of a section [1/s]; w: x of each section."""
    rate = p[row + 2, j]
    y1 = 2.0 * w[0] - z
    y2 = 2.0 * w[1] - y1
    y3 = 2.0 * w[2] - y2
    y4 = 2.0 * w[3] - y3
    y5 = 2.0 * w[4] - y4
    y6 = 2.0 * w[5] - y5
    y7 = 2.0 * w[6] - y6
    y8 = 2.0 * w[7] - y7
    return -(p[row, j] * y4 + p[row + 1, j] * y8), (
        rate * (z - w[0]), rate * (y1 - w[1]), rate * (y2 - w[2]), rate * (y3 - w[3]), rate * (y4 - w[4]),
        rate * (y5 - w[5]), rate * (y6 - w[6]), rate * (y7 - w[7]),
    )  # fmt: skip


def constants(p: Values) -> tuple[float, ...]:
    """In the law's order."""
    return p["early"], p["late"], 1.0 / p["time"]


MECHANISM = OscillatorMechanism(
    id="unnamed.feedback",
    statement="A force follows the motion late, as of a loop around the device.",
    parameters=(
        coefficient("early", "1/s^2", "of the force that is half as late", lambda s: s.rate**2, default=0.0),
        coefficient("late", "1/s^2", "of the force that is latest", lambda s: s.rate**2, default=0.0),
        shape("time", "s", "of each of eight sections", lambda s: 1.0 / s.rate, shape_range=(0.15, 2.5), grid=6),
    ),
    memory=Memory(fed_back, SECTIONS, constants, start=lambda z, v: (z,) * SECTIONS),
    fastest_rate=lambda p, speed: RELAXATION / p["time"],
)  # fmt: skip
