"""Every mechanism of the VO2 actuator, one file each; a new one is one line here, in the file formats' order."""

from rtctl.simulations.vo2.mechanism import Vo2Mechanism
from rtctl.simulations.vo2.mechanisms import (
    actuation_deadband,
    actuation_delay,
    heater_tcr,
    hysteresis_creep,
    hysteresis_rate_dependence,
    hysteresis_shape,
    sensor_ageing,
    sensor_crosstalk,
    sensor_lag,
    sensor_self_heating,
    structure_resonance,
    thermal_ambient_drift,
    thermal_latent_heat,
    thermal_nonlinear_loss,
    thermal_second_time_constant,
)

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
    )
}
