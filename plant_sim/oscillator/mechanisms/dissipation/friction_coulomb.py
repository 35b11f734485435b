"""`friction.coulomb`: - level sign z', with stiction as strong."""

from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

MECHANISM = OscillatorMechanism(
    id="friction.coulomb",
    statement="Dry friction of {level} opposes the motion.",
    parameters=(
        coefficient("level", "{z}/s^2", "of the friction", lambda s: s.acceleration, low=0.0, kinked=True),
    ),
    terms={"friction": "level"},
)
