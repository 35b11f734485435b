"""`sensor.drift`: the reading is z + rate d (1 - exp(-t / d)), t from the record's first sample.

d is the settling time; without one the reading is z + rate t.
"""

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient
from rtctl.border.mechanisms import FIRST_RATE, drift_of, settling_time


def drifting(moved: Moved, p: Values) -> Moved:
    """Return the reading with a zero that moves."""
    return moved._replace(
        displacement=moved.displacement + p["rate"] * drift_of(moved.time_s, p["settling_time"])
    )


MECHANISM = OscillatorMechanism(
    id="sensor.drift",
    statement="The reading drifts by {rate} from the start of each record.",
    forms={
        "settling_time": "The reading drifts by {rate} at the start of each record and settles with a time constant "
        "of {settling_time}."
    },
    parameters=(
        coefficient(
            "rate", "{y}/s", "of the reading's zero", lambda s: s.reading / s.duration, reach=FIRST_RATE
        ),
        settling_time(),
    ),
    in_steady_state=False,
    sensor=drifting,
    stage=6,
    slow=True,
)
