"""`sensor.highpass`: D - w is read instead of D, w' = rate (D - settled D_0 - w), w = 0 at a record's first sample.

D_0 is the first deflection: a reading that was AC-coupled long before a record (`settled` = 1) returns to where it
began, one that is switched on with it to zero.
"""

import numpy as np

from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient, shape
from rtctl.simulations.vo2.relaxation import lag


def coupled(read: Read, p: Values) -> Read:
    """Pass the deflection by a first-order high-pass; it is linear between instants."""
    D, left = read.deflection, np.exp(-p["rate"] * read.time_s)
    rest = D[0] * (left + p["settled"] * (1.0 - left))
    return read._replace(deflection=D - lag(D, read.steps_s, 1.0 / p["rate"]) + rest)


MECHANISM = Vo2Mechanism(
    id="sensor.highpass",
    statement="The deflection reading is AC-coupled: below a corner of {rate} it loses what is slow.",
    parameters=(
        coefficient(
            "rate", "1/s", "at the corner of the high-pass (2 pi times its frequency)", lambda s: s.rate, low=0.0
        ),
        shape(
            "settled", "dimensionless", "share of the first deflection that it had forgotten when a record began", 1.0,
            default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0), also=(0.0,), redundant=True,
        ),
    ),
    instrument=coupled,
    resolves=0.25,
    stage=4,
)  # fmt: skip
