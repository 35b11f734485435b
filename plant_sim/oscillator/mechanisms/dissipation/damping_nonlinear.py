"""`damping.nonlinear`: - coefficient z^2 z'."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="damping.nonlinear",
    statement="The damping grows with the square of the displacement: {coefficient} z^2 z'.",
    parameters=(
        coefficient(
            "coefficient",
            "1/({z}^2*s)",
            "of z^2 z'",
            lambda s: s.acceleration / (s.displacement**2 * s.velocity),
        ),
    ),
    terms={"damping_2": "coefficient"},
)
