"""`stiffness.quadratic`: - coefficient z^2."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="stiffness.quadratic",
    statement="The restoring force is not symmetric: {coefficient} z^2 pulls to one side.",
    parameters=(
        coefficient(
            "coefficient",
            "1/({z}*s^2)",
            "of z^2 in the restoring force",
            lambda s: s.acceleration / s.displacement**2,
        ),
    ),
    terms={"quadratic": "coefficient"},
)
