"""`sensor.offset`: the reading is z + offset."""

from plant_sim.oscillator.mechanism import Moved, OscillatorMechanism, Values, coefficient


def shifted(moved: Moved, p: Values) -> Moved:
    """Return the reading with the sensor's zero off by `offset`."""
    return moved._replace(displacement=moved.displacement + p["offset"])


MECHANISM = OscillatorMechanism(
    id="sensor.offset",
    statement="The sensor reads {offset} too much.",
    parameters=(coefficient("offset", "{y}", "of the reading", lambda s: s.reading),),
    in_steady_state=False,
    sensor=shifted,
    unread=lambda reading, p: reading - p["offset"],
    stage=4,
)
