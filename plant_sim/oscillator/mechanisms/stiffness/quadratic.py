"""`stiffness.quadratic`: - coefficient z^2.

About the place to which a constant force moves a hardening spring, its force is k' y + 3 k3 z0 y^2 + k3 y^3.
"""

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
    about_another_zero=lambda p: ("drive.offset",) if p.get("stiffness_cubic") else (),
)
