"""`stiffness.quintic`: - coefficient z^5."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="stiffness.quintic",
    statement="The restoring force has a term of the fifth order: {coefficient} z^5.",
    parameters=(
        coefficient(
            "coefficient",
            "1/({z}^4*s^2)",
            "of z^5 in the restoring force",
            lambda s: s.acceleration / s.displacement**5,
        ),
    ),
    terms={"quintic": "coefficient"},
)
