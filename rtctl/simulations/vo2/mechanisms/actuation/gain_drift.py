"""`input.gain_drift`: the current is i (1 + rate d (1 - exp(-t / d))), t since the record's first sample.

d is the settling time; without one the current is i (1 + rate t).
"""

import numpy as np

from rtctl.border.mechanisms import FIRST_RATE, drift_of, settling_time
from rtctl.simulations.vo2.mechanism import Pieces, Values, Vo2Mechanism, coefficient

INSTANTS = np.array([0.0, 0.5, 1.0])
"""Start, middle and end of a piece, in its duration."""


def drifting(pieces: Pieces, p: Values) -> Pieces:
    """Change the gain of the current."""
    durations = pieces.durations_s
    starts = np.concatenate(([0.0], np.cumsum(durations)[:-1]))
    within = starts[:, None] + durations[:, None] * INSTANTS
    periods = len(pieces.nodes) // len(durations)
    time_s = float(durations.sum()) * np.arange(periods)[:, None, None] + within
    drift = p["rate"] * drift_of(time_s.reshape(-1, 3), p["settling_time"])
    return pieces._replace(nodes=pieces.nodes * (1.0 + drift))


MECHANISM = Vo2Mechanism(
    id="input.gain_drift",
    statement="The gain of the current drifts by {rate} of itself from the start of each record.",
    forms={
        "settling_time": "The gain of the current drifts by {rate} of itself at the start of each record and settles "
        "with a time constant of {settling_time}."
    },
    parameters=(
        coefficient("rate", "1/s", "relative, of the current's gain", lambda s: 0.1 / s.duration, reach=FIRST_RATE),
        settling_time(),
    ),
    pieces=drifting,
    slow=True,
)  # fmt: skip
