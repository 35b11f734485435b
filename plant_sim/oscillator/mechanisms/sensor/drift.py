"""`sensor.drift`: the reading is z + rate t, t from the record's first sample."""

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient


def drifting(moved: Moved, p: Values) -> Moved:
    """Return the reading with a zero that moves."""
    return moved._replace(displacement=moved.displacement + p["rate"] * moved.time_s)


MECHANISM = OscillatorMechanism(
    id="sensor.drift",
    statement="The reading drifts by {rate} from the start of each record.",
    parameters=(coefficient("rate", "{y}/s", "of the reading's zero", lambda s: s.reading / s.duration),),
    in_steady_state=False,
    sensor=drifting,
    stage=6,
    slow=True,
)
