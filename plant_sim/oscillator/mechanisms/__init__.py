"""Every mechanism of the oscillators, one file each; a new one is one line here.

The order is that of the file formats; where two act at one place, their `stage` decides.
"""

from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.mechanisms import (
    drive_delay,
    sensor_offset,
    stiffness_quadratic,
    stiffness_viscoelastic,
)

MECHANISMS: dict[str, OscillatorMechanism] = {
    module.MECHANISM.id: module.MECHANISM
    for module in (stiffness_quadratic, stiffness_viscoelastic, drive_delay, sensor_offset)
}
