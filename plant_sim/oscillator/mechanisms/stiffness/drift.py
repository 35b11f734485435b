"""`stiffness.drift`: - rate t z, t from the record's first sample."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="stiffness.drift",
    statement="The stiffness drifts by {rate} from the start of each record.",
    parameters=(
        coefficient(
            "rate", "1/s^3", "of the stiffness", lambda s: s.acceleration / (s.displacement * s.duration)
        ),
    ),
    terms={"drift": "rate"},
    in_steady_state=False,
)
