"""All mechanisms of the VO2 actuator, one file each; a new one is one line here, in the file formats' order."""

from rtctl.simulations.vo2.mechanism import Vo2Mechanism
from rtctl.simulations.vo2.mechanisms.actuation import deadband as actuation_deadband
from rtctl.simulations.vo2.mechanisms.actuation import delay as actuation_delay
from rtctl.simulations.vo2.mechanisms.actuation import gain_drift as input_gain_drift
from rtctl.simulations.vo2.mechanisms.actuation import structure_resonance
from rtctl.simulations.vo2.mechanisms.hysteresis import creep as hysteresis_creep
from rtctl.simulations.vo2.mechanisms.hysteresis import rate_dependence as hysteresis_rate_dependence
from rtctl.simulations.vo2.mechanisms.hysteresis import shape as hysteresis_shape
from rtctl.simulations.vo2.mechanisms.sensor import ageing as sensor_ageing
from rtctl.simulations.vo2.mechanisms.sensor import crosstalk as sensor_crosstalk
from rtctl.simulations.vo2.mechanisms.sensor import deflection_lag as sensor_deflection_lag
from rtctl.simulations.vo2.mechanisms.sensor import drift as sensor_drift
from rtctl.simulations.vo2.mechanisms.sensor import highpass as sensor_highpass
from rtctl.simulations.vo2.mechanisms.sensor import lag as sensor_lag
from rtctl.simulations.vo2.mechanisms.sensor import quantisation as sensor_quantisation
from rtctl.simulations.vo2.mechanisms.sensor import self_heating as sensor_self_heating
from rtctl.simulations.vo2.mechanisms.thermal import ambient_drift as thermal_ambient_drift
from rtctl.simulations.vo2.mechanisms.thermal import heater_tcr
from rtctl.simulations.vo2.mechanisms.thermal import latent_heat as thermal_latent_heat
from rtctl.simulations.vo2.mechanisms.thermal import nonlinear_loss as thermal_nonlinear_loss
from rtctl.simulations.vo2.mechanisms.thermal import phase_heating as thermal_phase_heating
from rtctl.simulations.vo2.mechanisms.thermal import second_time_constant as thermal_second_time_constant
from rtctl.simulations.vo2.mechanisms.timing import skew as timing_skew

MECHANISMS: dict[str, Vo2Mechanism] = {
    module.MECHANISM.id: module.MECHANISM
    for module in (
        thermal_second_time_constant,
        thermal_nonlinear_loss,
        thermal_latent_heat,
        thermal_ambient_drift,
        heater_tcr,
        actuation_delay,
        actuation_deadband,
        structure_resonance,
        hysteresis_rate_dependence,
        hysteresis_creep,
        hysteresis_shape,
        sensor_self_heating,
        sensor_lag,
        sensor_ageing,
        sensor_crosstalk,
        sensor_deflection_lag,
        timing_skew,
        sensor_highpass,
        sensor_drift,
        sensor_quantisation,
        input_gain_drift,
        thermal_phase_heating,
    )
}
