"""`stiffness.quadratic`: - coefficient z^2."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient
from plant_sim.oscillator.mechanisms.stiffness.another_zero import alike_about_another_zero

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
    about_another_zero=alike_about_another_zero("drive.offset"),
)
