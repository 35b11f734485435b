"""`sensor.highpass`: z - w is read instead of z, w' = rate (z - w), w = 0 at a record's first sample (AC coupling)."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient
from plant_sim.oscillator.mechanisms.sensor.lag import behind
from rtctl.border.arrays import ComplexArray


def coupled(moved: Moved, p: Values) -> Moved:
    """Return the reading behind a first-order high-pass that passes the first sample as it is."""
    if p["rate"] == 0.0:
        return moved
    z = moved.displacement
    reading = z - behind(moved, 1.0 / p["rate"]) + z[0] * np.exp(-p["rate"] * moved.time_s)
    return moved._replace(displacement=reading, filtered_slope=moved.slope - p["rate"] * reading)


def passed(s: ComplexArray, p: Values) -> ComplexArray:
    """Return the high-pass at complex angular frequency s [1/s]; a constant, of which nothing is read, is kept."""
    return s / np.where(s == 0.0, 1.0, s + p["rate"])


MECHANISM = OscillatorMechanism(
    id="sensor.highpass",
    statement="The reading is AC-coupled: below a corner of {rate} it loses what is slow.",
    parameters=(
        coefficient(
            "rate",
            "1/s",
            "at the corner of the high-pass (2 pi times its frequency)",
            lambda s: s.rate,
            low=0.0,
        ),
    ),
    sensor=coupled,
    transfer=passed,
    looks_between=True,
    stage=1,
)
