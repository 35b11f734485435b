"""`sensor.drift`: D + rate d (1 - exp(-t / d)) is read, t since the record's first sample, d the settling time.

Without one D + rate t is read. The resistance's drift is `sensor.ageing`.
"""

from rtctl.border.mechanisms import FIRST_RATE, drift_of, settling_time
from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient


def drifting(read: Read, p: Values) -> Read:
    """Move the zero of the deflection reading."""
    return read._replace(deflection=read.deflection + p["rate"] * drift_of(read.time_s, p["settling_time"]))


MECHANISM = Vo2Mechanism(
    id="sensor.drift",
    statement="The deflection reading drifts by {rate} from the start of each record.",
    forms={
        "settling_time": "The deflection reading drifts by {rate} at the start of each record and settles with a time "
        "constant of {settling_time}."
    },
    parameters=(
        coefficient("rate", "um/s", "of the reading's zero", lambda s: s.excursion / s.duration, reach=FIRST_RATE),
        settling_time(),
    ),
    instrument=drifting,
    stage=5,
    slow=True,
)  # fmt: skip
