"""All generic mechanisms of a system, by id: those of inputs, of outputs, of states, of parameters."""

from __future__ import annotations

from collections.abc import Mapping

from plant_sim.equations.mechanisms.mechanism import EquationsMechanism
from plant_sim.equations.mechanisms.parameters import parameter_mechanisms
from plant_sim.equations.mechanisms.signals import signal_mechanisms
from plant_sim.equations.mechanisms.sizes import Sizes
from plant_sim.equations.mechanisms.states import state_mechanisms
from plant_sim.equations.mechanisms.words import Names
from plant_sim.equations.system import System


def catalogue(system: System, units: Mapping[str, str], sizes: Sizes) -> dict[str, EquationsMechanism]:
    """Return the mechanisms of `system`.

    Args:
        system: The equations.
        units: Units of the data's signals by name; an output that was not measured has that of the model.
        sizes: Sizes of all courses, in the data's units and those of the states.
    """
    names = Names(system)
    found = signal_mechanisms(system, units, sizes)
    references: dict[str, str] = {}
    for state, switched in zip(system.states, system.discrete, strict=True):
        if switched:  # it has no law in time
            continue
        own = state_mechanisms(state, sizes[state.name], names)
        for name in own[0].references:
            references[state.name] = name
        found += own
    for parameter in system.parameters:
        found += parameter_mechanisms(parameter, system, sizes, names, references)
    return {one.id: one for one in found}
