"""`sensor.ageing`: R exp(rate t + bend t^2) is read, t since the record's first sample."""

import numpy as np

from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient


def ageing(read: Read, p: Values) -> Read:
    """Change the film's resistance by the same fraction in equal times, or ever faster or slower."""
    drift = (p["rate"] + p["bend"] * read.time_s) * read.time_s
    return read._replace(resistance=read.resistance * np.exp(drift))


MECHANISM = Vo2Mechanism(
    id="sensor.ageing",
    statement="The resistance drifts, by {rate} of itself at first, and bends by {bend}.",
    parameters=(
        coefficient("rate", "1/s", "relative, at each record's start", lambda s: 0.1 / s.duration),
        coefficient(
            "bend",
            "1/s^2",
            "relative, of a drift that grows or slackens",
            lambda s: 0.1 / s.duration**2,
            default=0.0,
        ),
    ),
    instrument=ageing,
    stage=1,
    slow=True,
)
