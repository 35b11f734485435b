"""`sensor.crosstalk`: R + leak (i - known v) is read, i the current that flows while the reading is taken.

At rest v = i: loops that were identified on the same device hold leak v already. Where a converter steps at the
sample's instant, no manifest says whether the reading is taken before or after: `before` is the share of before.
"""

from rtctl.simulations.vo2.mechanism import (
    Read,
    Values,
    Vo2Mechanism,
    coefficient,
    known,
    shape,
)


def leaking(read: Read, p: Values) -> Read:
    """Add the heater's current to the resistance reading."""
    current = p["before"] * read.current + (1.0 - p["before"]) * read.current_after
    seen = current - p["known"] * read.surrogate
    return read._replace(resistance=read.resistance + p["leak"] * seen)


MECHANISM = Vo2Mechanism(
    id="sensor.crosstalk",
    statement="The heater's current leaks into the resistance reading: {leak}.",
    parameters=(
        coefficient(
            "leak", "ohm/mA", "of the reading, on the heater's current",
            lambda s: 0.5 * s.sensed / s.drive,
        ),
        known(),
        shape(
            "before", "dimensionless", "share of the reading that is taken before the current steps", 1.0,
            default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0),
        ),
    ),
    instrument=leaking,
    stage=2,
)  # fmt: skip
