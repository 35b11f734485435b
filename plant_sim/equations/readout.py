"""Outputs and states of a motion, as a model's equations read them."""

from __future__ import annotations

import numpy as np

from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.functions import TIME
from plant_sim.equations.marching import Motion
from plant_sim.equations.system import System, terms_of_outputs
from rtctl.border.arrays import FloatArray


def read_outputs(
    system: System, motion: Motion, nodes: FloatArray, p: FloatArray, step_s: float,
    factors: FloatArray, shown: int,
) -> dict[str, FloatArray]:  # fmt: skip
    """Return outputs and the first `shown` states (lanes, instants); inputs are as they are just before each instant.

    Args:
        system: The equations.
        motion: States at evenly spaced instants.
        nodes: Inputs (3, steps, inputs) [SI].
        p: Parameters (parameters, lanes) [SI].
        step_s: Time between two instants [s].
        factors: SI units (outputs,) of the units of the outputs that are returned.
        shown: Number of states that are returned, in their own units.
    """
    x, steps = motion.x, motion.substeps // motion.between
    values: dict[str, FloatArray] = {TIME: step_s * np.arange(len(x), dtype=np.float64)}
    for k, state in enumerate(system.states):
        values[state.name] = x[:, k].T
    for k, source in enumerate(system.inputs):
        values[source.name] = np.concatenate((nodes[0, :1, k], nodes[2, steps - 1 :: steps, k]))
    for k, parameter in enumerate(system.parameters):
        values[parameter.name] = p[k][:, None]
    for name, tree in terms_of_outputs(system).items():
        values[name] = evaluate(tree, values)
    shape = (x.shape[2], len(x))
    found: dict[str, FloatArray] = {}
    for k, output in enumerate(system.outputs):
        made = np.broadcast_to(evaluate(output.value, values), shape) / factors[k]
        found[output.name] = np.ascontiguousarray(made)
    for state in system.states[:shown]:
        if state.name not in found:
            found[state.name] = np.ascontiguousarray(values[state.name] / state.factor)
    return found
