"""Every mechanism of the VO2 actuator, one file each; a new one is one line here, in the file formats' order."""

from rtctl.simulations.vo2.mechanism import Vo2Mechanism
from rtctl.simulations.vo2.mechanisms import (
    actuation_delay,
    sensor_lag,
)

MECHANISMS: dict[str, Vo2Mechanism] = {
    module.MECHANISM.id: module.MECHANISM
    for module in (
        actuation_delay,
        sensor_lag,
    )
}
