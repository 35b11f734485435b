"""A user's file: a sensor that bends, as a mechanism of oscillators."""

import rtctl
from plant_sim.oscillator.mechanism import OscillatorMechanism, coefficient

BENT_SENSOR = OscillatorMechanism(
    id="sensor.quadratic",
    statement="The sensor adds {coefficient} of the displacement's square.",
    parameters=(coefficient("coefficient", "1/{z}", "of z^2", lambda s: 1.0 / s.displacement),),
    sensor=lambda moved, values: moved._replace(
        displacement=moved.displacement + values["coefficient"] * moved.displacement**2
    ),
)
rtctl.register("mechanism", "sensor.quadratic", BENT_SENSOR)
