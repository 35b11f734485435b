"""`damping.asymmetric`: - coefficient |z'|."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="damping.asymmetric",
    statement="The damping depends on the direction of the motion: {coefficient} is added to it where the displacement "
    "grows, and taken away where it falls.",
    parameters=(
        coefficient(
            "coefficient", "1/s", "half of the difference of the two", lambda s: s.acceleration / s.velocity
        ),
    ),
    terms={"damping_even": "coefficient"},
)
