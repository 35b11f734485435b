"""`sensor.hum`: the reading has cosine cos(2 pi frequency t) + sine sin(2 pi frequency t) in it."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient, shape


def humming(moved: Moved, p: Values) -> Moved:
    """The reading with mains in it; t from the record's first sample."""
    angle = 2.0 * np.pi * p["frequency"] * moved.time_s
    return moved._replace(
        displacement=moved.displacement + p["cosine"] * np.cos(angle) + p["sine"] * np.sin(angle)
    )


MECHANISM = OscillatorMechanism(
    id="sensor.hum",
    statement="Hum at {frequency} is in the displacement reading ({cosine}, {sine}).",
    parameters=(
        coefficient("cosine", "{z}", "of the hum at the record's first sample", lambda s: s.displacement),
        coefficient("sine", "{z}", "a quarter of a period later", lambda s: s.displacement),
        shape("frequency", "Hz", "of the hum", lambda s: 50.0, default=50.0),
    ),
    sensor=humming,
    stage=4,
)
