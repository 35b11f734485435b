"""`sensor.quantisation`: the level nearest to z is read, of levels that are a step apart."""

from __future__ import annotations

import numpy as np

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient, shape


def rounded(moved: Moved, p: Values) -> Moved:
    """Return the reading as a converter rounds it."""
    if p["step"] == 0.0:
        return moved
    steps = np.rint((moved.displacement - p["level"]) / p["step"])
    return moved._replace(displacement=p["level"] + p["step"] * steps)


MECHANISM = OscillatorMechanism(
    id="sensor.quantisation",
    statement="The readings have a step of {step}.",
    parameters=(
        coefficient(
            "step", "{y}", "from one level of the readings to the next", lambda s: s.reading, low=0.0
        ),
        shape("level", "{y}", "one of the levels", lambda s: s.reading, default=0.0, low=-np.inf),
    ),
    in_steady_state=False,
    sensor=rounded,
    stage=7,
    by_levels=True,
)
