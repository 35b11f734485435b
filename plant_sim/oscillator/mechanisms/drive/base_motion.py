"""`base.motion`: + cosine cos(2 pi frequency t) + sine sin(2 pi frequency t), a force that no input shows.

A tone, as of a machine beside the bench; t from the record's first sample, and each record has its own phase. It acts
through the device, unlike hum in a reading: near the resonance it is amplified, and a device that is not linear mixes
it with the drive. A linear device alone does not tell it from a tone that the sensor adds.
"""

from __future__ import annotations

import math
from typing import Any

from plant_sim.oscillator.equation.binding import law
from plant_sim.oscillator.mechanism import Memory, OscillatorMechanism, Values, coefficient, shape


# 8 parameters because every memory law has them (`plant_sim.oscillator.equation.memory`)
@law
def shaken(z: float, v: float, u: float, t: float, w: Any, p: Any, row: int, j: int) -> Any:  # noqa: PLR0913
    """Return force and rates; p: cosine, sine, angular frequency [1/s]; w: cosine and sine of the phase.

    States, because a sine in each step takes longer than all the rest, and a device's clock has no start.
    """
    return p[row, j] * w[0] + p[row + 1, j] * w[1], (-p[row + 2, j] * w[1], p[row + 2, j] * w[0])


def constants(p: Values) -> tuple[float, ...]:
    """Return the constants of `shaken`."""
    return p["cosine"], p["sine"], 2.0 * math.pi * p["frequency"]


MECHANISM = OscillatorMechanism(
    id="base.motion",
    statement="The base moves, which was not measured: a tone at {frequency} acts on the device ({cosine}, {sine}).",
    parameters=(
        coefficient(
            "cosine", "{z}/s^2", "of the tone at the record's first sample", lambda s: s.acceleration, default=0.0,
            per_record=True,
        ),
        coefficient(
            "sine", "{z}/s^2", "a quarter of a period later", lambda s: s.acceleration, default=0.0,
            per_record=True,
        ),
        shape(
            "frequency", "Hz", "of the tone", lambda s: s.rate / (2.0 * math.pi), shape_range=(0.1, 10.0), grid=1,
            least_periods=10.0,
        ),
    ),
    in_steady_state=False,
    memory=Memory(shaken, 2, constants, start=lambda z, v: (1.0, 0.0)),
    fastest_rate=lambda p, speed: 2.0 * math.pi * p["frequency"],
)  # fmt: skip
