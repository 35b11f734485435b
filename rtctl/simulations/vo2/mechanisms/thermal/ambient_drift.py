"""`thermal.ambient_drift`: the film is at T + rate d (1 - exp(-t / d)), t since the record's first sample.

T is by its heat alone, d the settling time; without one it is at T + rate t.

A room that cools takes it below all that was identified, one that warms above. Nothing switches there: the
semiconductor conducts less by `activation`, the beam bends by -`expansion`.
"""

import numpy as np

from rtctl.border.mechanisms import FIRST_RATE, settling_time
from rtctl.simulations.vo2.mechanism import (
    ACTIVATION,
    EXPANSION,
    Balance,
    Read,
    Values,
    Vo2Mechanism,
    coefficient,
    power_of,
)


def drifting(balance: Balance, p: Values) -> Balance:
    """Let the ambient warm or cool."""
    return balance._replace(drift=p["rate"], settling_s=p["settling_time"])


def beyond_the_loops(read: Read, p: Values) -> Read:
    """Extrapolate below and above the identified range."""
    below = np.minimum(read.temperature - read.phases.coldest, 0.0)
    above = np.maximum(read.temperature - read.phases.hottest, 0.0)
    return read._replace(
        reading=read.reading + p["activation"] * below,
        deflection=read.deflection - p["expansion"] * (below + above),
    )


MECHANISM = Vo2Mechanism(
    id="thermal.ambient_drift",
    statement="The ambient temperature drifts, as if the heating power grew by {rate}.",
    forms={
        "settling_time": "The ambient temperature drifts, as if the heating power grew by {rate} at first; the drift "
        "settles with a time constant of {settling_time}."
    },
    parameters=(
        coefficient(
            "rate", "mA^2/s", "of the surrogate's power, from each record's start",
            lambda s: 0.1 * power_of(s) / s.duration, reach=FIRST_RATE,
        ),
        settling_time(),
        ACTIVATION,
        EXPANSION,
    ),
    balance=drifting,
    film=beyond_the_loops,
    slow=True,
)  # fmt: skip
