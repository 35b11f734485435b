"""`sensor.ageing`: R exp(rate t) is read, t since the record's first sample."""

import numpy as np

from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient


def ageing(read: Read, p: Values) -> Read:
    """The film's resistance grows or falls by the same fraction in equal times."""
    return read._replace(resistance=read.resistance * np.exp(p["rate"] * read.time_s))


MECHANISM = Vo2Mechanism(
    id="sensor.ageing",
    statement="The resistance drifts, by {rate} of itself.",
    parameters=(
        coefficient("rate", "1/s", "relative, from each record's start", lambda s: 0.1 / s.duration),
    ),
    instrument=ageing,
    stage=1,
)
