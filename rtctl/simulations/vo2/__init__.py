"""The identified VO2 actuator: current -> heat -> film -> readings, and the effects that a nominal model omits."""

from rtctl.simulations.vo2.extending import extended_model
from rtctl.simulations.vo2.mechanisms import MECHANISMS
from rtctl.simulations.vo2.model import vo2_simulation
from rtctl.simulations.vo2.simulation import Vo2Simulation

__all__ = ["MECHANISMS", "Vo2Simulation", "extended_model", "vo2_simulation"]
