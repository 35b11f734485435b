"""`stiffness.cubic`: - coefficient z^3, beside the nominal cubic stiffness."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="stiffness.cubic",
    statement="The spring hardens or softens with the square of the displacement: {coefficient} z^3.",
    parameters=(
        coefficient(
            "coefficient",
            "1/({z}^2*s^2)",
            "of z^3 in the restoring force",
            lambda s: s.acceleration / s.displacement**3,
        ),
    ),
    terms={"cubic": "coefficient"},
)
