"""Laws that have the form of a mechanism and no name: what they explain better than any cause has another cause."""

from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.nonparametric import dissipation, feedback, relaxations, spring, stop

UNNAMED: dict[str, OscillatorMechanism] = {
    module.MECHANISM.id: module.MECHANISM for module in (spring, stop, dissipation, feedback, relaxations)
}
