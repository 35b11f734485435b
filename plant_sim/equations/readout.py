"""Outputs and states of a motion, as a model's equations read them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.functions import TIME
from plant_sim.equations.marching import Motion
from plant_sim.equations.system import System, terms_of_outputs
from rtctl.border.arrays import FloatArray


# 8 parameters because a reading depends on all of these
def read_outputs(  # noqa: PLR0913
    system: System, motion: Motion, nodes: FloatArray, p: FloatArray, step_s: float,
    factors: FloatArray, shown: int, after_jumps: Mapping[str, FloatArray],
) -> dict[str, FloatArray]:  # fmt: skip
    """Return outputs and the first `shown` states (lanes, instants).

    Inputs are as they are just before each instant, or just after it.

    Args:
        system: The equations.
        motion: States at evenly spaced instants.
        nodes: Inputs (3, steps, inputs) [SI].
        p: Parameters (parameters, lanes) [SI].
        step_s: Time between two instants [s].
        factors: SI units (outputs,) of the units of the outputs that are returned.
        shown: Number of states that are returned, in their own units.
        after_jumps: Of each output that is read just after its inputs jump, the inputs (inputs,) [SI] after the last
            instant.
    """
    x, steps = motion.x, motion.substeps // motion.between
    values: dict[str, FloatArray] = {TIME: step_s * np.arange(len(x), dtype=np.float64)}
    for k, state in enumerate(system.states):
        values[state.name] = x[:, k].T
    for k, source in enumerate(system.inputs):
        values[source.name] = np.concatenate((nodes[0, :1, k], nodes[2, steps - 1 :: steps, k]))
    for k, parameter in enumerate(system.parameters):
        values[parameter.name] = p[k][:, None]
    before = _with_terms(system, values)
    shape = (x.shape[2], len(x))
    found: dict[str, FloatArray] = {}
    for k, output in enumerate(system.outputs):
        seen = before
        if output.name in after_jumps:
            last = after_jumps[output.name]
            later = {
                source.name: np.append(nodes[0, ::steps, i], last[i])
                for i, source in enumerate(system.inputs)
            }
            seen = _with_terms(system, values | later)
        made = np.broadcast_to(evaluate(output.value, seen), shape)
        with np.errstate(over="ignore"):  # of a lane that runs away
            found[output.name] = np.ascontiguousarray(made / factors[k])
    with np.errstate(over="ignore"):  # of a lane that runs away
        for state in system.states[:shown]:
            if state.name not in found:
                found[state.name] = np.ascontiguousarray(values[state.name] / state.factor)
    return found


def _with_terms(system: System, values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return values with those of the terms that outputs have."""
    found = dict(values)
    for name, tree in terms_of_outputs(system).items():
        found[name] = evaluate(tree, found)
    return found
