"""Every mechanism of the oscillators, one file each; a new one is one line here.

The order is that of the file formats; where two act at one place, their `stage` decides.
"""

from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.mechanisms import (
    damping_nonlinear,
    damping_quadratic,
    drive_deadband,
    drive_delay,
    drive_harmonics,
    drive_lag,
    drive_offset,
    drive_saturation,
    friction_coulomb,
    hysteresis_bouc_wen,
    input_hold,
    mode_second,
    sensor_hum,
    sensor_lag,
    sensor_offset,
    sensor_saturation,
    stiffness_cubic,
    stiffness_drift,
    stiffness_parametric,
    stiffness_quadratic,
    stiffness_quintic,
    stiffness_viscoelastic,
)

MECHANISMS: dict[str, OscillatorMechanism] = {
    module.MECHANISM.id: module.MECHANISM
    for module in (
        stiffness_quadratic,
        stiffness_cubic,
        stiffness_quintic,
        stiffness_parametric,
        stiffness_drift,
        stiffness_viscoelastic,
        damping_nonlinear,
        damping_quadratic,
        friction_coulomb,
        hysteresis_bouc_wen,
        mode_second,
        drive_harmonics,
        drive_saturation,
        drive_deadband,
        drive_delay,
        drive_lag,
        drive_offset,
        sensor_saturation,
        sensor_offset,
        sensor_lag,
        sensor_hum,
        input_hold,
    )
}
