"""`drive.delay`: u(t - delay)."""

import numpy as np

from plant_sim.oscillator.mechanism import OscillatorMechanism, Sampled, Values, coefficient


def late(drive: Sampled, p: Values) -> Sampled:
    """Return the drive `delay` [s] later."""
    return drive._replace(delay_s=drive.delay_s + p["delay"])


MECHANISM = OscillatorMechanism(
    id="drive.delay",
    statement="The drive acts {delay} late.",
    parameters=(
        coefficient("delay", "s", "from the drive's samples to the force", lambda s: 1.0 / s.rate, low=0.0),
    ),
    input=late,
    transfer=lambda s, p: np.exp(-p["delay"] * s),
    stage=1,
)
