"""Nonparametric laws in the form of a mechanism: data that they explain better than any cause have another cause."""

from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.nonparametric import dissipation, feedback, relaxations, spring, stop

UNNAMED: dict[str, OscillatorMechanism] = {
    module.MECHANISM.id: module.MECHANISM for module in (spring, stop, dissipation, feedback, relaxations)
}
