"""`stiffness.parametric`: - coefficient u z."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="stiffness.parametric",
    statement="The drive changes the stiffness by {coefficient} times its value (delta-E effect).",
    parameters=(
        coefficient(
            "coefficient",
            "1/(({u})*s^2)",
            "of u z in the restoring force",
            lambda s: s.acceleration / (s.displacement * s.drive),
        ),
    ),
    terms={"parametric": "coefficient"},
    in_steady_state=False,
)
