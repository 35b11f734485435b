"""`sensor.hum`: the reading has cosine cos(2 pi frequency t) + sine sin(2 pi frequency t) in it."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient, shape


def humming(moved: Moved, p: Values) -> Moved:
    """Return the reading with mains hum; t from the record's first sample."""
    angular = 2.0 * np.pi * p["frequency"]
    cosine, sine = moved.once(
        ("sensor.hum", angular), lambda: (np.cos(angular * moved.time_s), np.sin(angular * moved.time_s))
    )
    return moved._replace(displacement=moved.displacement + (p["cosine"] * cosine + p["sine"] * sine))


MECHANISM = OscillatorMechanism(
    id="sensor.hum",
    statement="Hum at {frequency} is in the reading ({cosine}, {sine}).",
    parameters=(
        coefficient(
            "cosine",
            "{y}",
            "of the hum at the record's first sample",
            lambda s: s.reading,
            default=0.0,
            per_record=True,
        ),
        coefficient(
            "sine",
            "{y}",
            "a quarter of a period later",
            lambda s: s.reading,
            default=0.0,
            per_record=True,
        ),
        shape(
            "frequency",
            "Hz",
            "of the hum",
            lambda s: 50.0,
            default=50.0,
            shape_range=(0.9, 1.3),
            least_periods=2.0,  # of fewer a phase in each record makes a drift
        ),
    ),
    in_steady_state=False,
    sensor=humming,
    stage=5,
)
