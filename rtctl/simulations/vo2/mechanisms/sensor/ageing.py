"""`sensor.ageing`: R (1 + rate s) is read, s = d ln(1 + t / d), t since the record's first sample, d the slowing time.

Without a slowing time s = t. Contacts and films age with the logarithm of time; how long the first, nearly straight
part lasts differs. A resistance that would not be positive is no number.
"""

import math

import numpy as np

from rtctl.arithmetic.elementary import log1p
from rtctl.border.kernels import kernel
from rtctl.border.mechanisms import STEADY, Parameter
from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient

SHORTEST_SLOWING = 1e-3
"""Slowing time, in durations of the records, from which the logarithm is searched: three decades of time."""
FASTEST = 1.0 / (SHORTEST_SLOWING * math.log1p(1.0 / SHORTEST_SLOWING))
"""First rate of a drift that slows down so early, over that of one with the same change in a record."""


@kernel
def slowed_s(time_s: float, slowing_s: float) -> float:
    """Return s [s] at one time [s] since the record's first sample; `slowing_s` is d."""
    return time_s if slowing_s == STEADY else slowing_s * log1p(time_s / slowing_s)


def ageing(read: Read, p: Values) -> Read:
    """Change the film's resistance by a share of itself that grows with time."""
    slowing_s = p["slowing_time"]
    passed = read.time_s if slowing_s == STEADY else slowing_s * np.log1p(read.time_s / slowing_s)
    aged = 1.0 + p["rate"] * passed
    return read._replace(resistance=read.resistance * np.where(aged > 0.0, aged, np.nan))


MECHANISM = Vo2Mechanism(
    id="sensor.ageing",
    statement="The resistance drifts by {rate} of itself from the start of each record.",
    forms={
        "slowing_time": "The resistance drifts by {rate} of itself at the start of each record and slows down: after "
        "{slowing_time} it grows with the logarithm of time."
    },
    parameters=(
        coefficient("rate", "1/s", "relative, at each record's start", lambda s: 0.1 / s.duration, reach=FASTEST),
        Parameter(
            name="slowing_time", unit="s", scale=lambda s: s.duration, neutral=None, default=STEADY, simplest=STEADY,
            meaning="time after which the drift grows with the logarithm of time; 0: it does not slow down",
            low=0.0, shape_range=(SHORTEST_SLOWING, 1.0), grid=4,
        ),
    ),
    instrument=ageing,
    stage=1,
    slow=True,
)  # fmt: skip
