"""`sensor.crosstalk`: R + leak (i - known v) is read, i the current that flows just before the sample.

At rest v = i: loops that were identified on the same device hold leak v already.
"""

from rtctl.simulations.vo2.mechanism import (
    TYPICAL_CURRENT_MA,
    TYPICAL_RESISTANCE_OHM,
    Read,
    Values,
    Vo2Mechanism,
    coefficient,
    known,
)


def leaking(read: Read, p: Values) -> Read:
    """The heater's current in the resistance reading."""
    seen = read.current - p["known"] * read.surrogate
    return read._replace(resistance=read.resistance + p["leak"] * seen)


MECHANISM = Vo2Mechanism(
    id="sensor.crosstalk",
    statement="The heater's current leaks into the resistance reading: {leak}.",
    parameters=(
        coefficient(
            "leak", "ohm/mA", "of the reading, on the heater's current",
            0.1 * TYPICAL_RESISTANCE_OHM / TYPICAL_CURRENT_MA,
        ),
        known(),
    ),
    instrument=leaking,
    stage=2,
)  # fmt: skip
