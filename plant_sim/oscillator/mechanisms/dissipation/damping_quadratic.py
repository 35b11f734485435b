"""`damping.quadratic`: - coefficient |z'| z'."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="damping.quadratic",
    statement="The damping grows with speed, as in a fluid: {coefficient} |z'| z'.",
    parameters=(
        coefficient("coefficient", "1/{z}", "of |z'| z'", lambda s: s.acceleration / s.velocity**2, low=0.0),
    ),
    terms={"damping_abs": "coefficient"},
)
