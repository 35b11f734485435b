"""Every mechanism of the oscillators, one file each; a new one is one line here.

The order is that of the file formats; where two act at one place, their `stage` decides.
"""

from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.mechanisms.contact import clearance as stiffness_clearance
from plant_sim.oscillator.mechanisms.contact import stop_one_sided, stop_two_sided
from plant_sim.oscillator.mechanisms.dissipation import (
    damping_asymmetric,
    damping_nonlinear,
    damping_power,
    damping_quadratic,
    friction_coulomb,
    friction_presliding,
    friction_stribeck,
    hysteresis_bouc_wen,
)
from plant_sim.oscillator.mechanisms.drive import backlash as actuator_backlash
from plant_sim.oscillator.mechanisms.drive import base_motion, input_hold
from plant_sim.oscillator.mechanisms.drive import deadband as drive_deadband
from plant_sim.oscillator.mechanisms.drive import delay as drive_delay
from plant_sim.oscillator.mechanisms.drive import gain_drift as input_gain_drift
from plant_sim.oscillator.mechanisms.drive import harmonics as drive_harmonics
from plant_sim.oscillator.mechanisms.drive import hysteresis as actuator_hysteresis
from plant_sim.oscillator.mechanisms.drive import lag as drive_lag
from plant_sim.oscillator.mechanisms.drive import offset as drive_offset
from plant_sim.oscillator.mechanisms.drive import saturation as drive_saturation
from plant_sim.oscillator.mechanisms.sensor import crosstalk as sensor_crosstalk
from plant_sim.oscillator.mechanisms.sensor import drift as sensor_drift
from plant_sim.oscillator.mechanisms.sensor import highpass as sensor_highpass
from plant_sim.oscillator.mechanisms.sensor import hum as sensor_hum
from plant_sim.oscillator.mechanisms.sensor import lag as sensor_lag
from plant_sim.oscillator.mechanisms.sensor import offset as sensor_offset
from plant_sim.oscillator.mechanisms.sensor import quantisation as sensor_quantisation
from plant_sim.oscillator.mechanisms.sensor import saturation as sensor_saturation
from plant_sim.oscillator.mechanisms.stiffness import cubic as stiffness_cubic
from plant_sim.oscillator.mechanisms.stiffness import drift as stiffness_drift
from plant_sim.oscillator.mechanisms.stiffness import gravity as stiffness_gravity
from plant_sim.oscillator.mechanisms.stiffness import mode_second
from plant_sim.oscillator.mechanisms.stiffness import parametric as stiffness_parametric
from plant_sim.oscillator.mechanisms.stiffness import quadratic as stiffness_quadratic
from plant_sim.oscillator.mechanisms.stiffness import quintic as stiffness_quintic
from plant_sim.oscillator.mechanisms.stiffness import viscoelastic as stiffness_viscoelastic
from plant_sim.oscillator.mechanisms.timing import skew as timing_skew

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
        friction_stribeck,
        friction_presliding,
        damping_power,
        stiffness_clearance,
        stop_one_sided,
        stop_two_sided,
        stiffness_gravity,
        base_motion,
        actuator_backlash,
        timing_skew,
        sensor_highpass,
        sensor_drift,
        sensor_quantisation,
        input_gain_drift,
        damping_asymmetric,
        sensor_crosstalk,
        actuator_hysteresis,
    )
}
