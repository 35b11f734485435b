"""What a model's events watch and set, as sources of compiled functions; and the sides on which a motion begins.

See `plant_sim.equations.compiled.crossing`, which calls them.
"""

from __future__ import annotations

import numpy as np

from plant_sim.equations.compiled.source import loaded, numbers_source
from plant_sim.equations.integration.steps import Places, values_at
from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.system import System, terms_of_events
from rtctl.border.arrays import FloatArray


def guards_source(system: System) -> str:
    """Return the source of `guards(x, u, t, p, j, out) -> 0`, which fills `out` (events,) with what is watched."""
    places = "".join(f"out[{e}], " for e in range(len(system.events)))
    watched = tuple(one.when for one in system.events)
    head = loaded(system, "guards(x, u, t, p, j, out)")
    return numbers_source(system, watched, head, f"{places}= {{numbers}},\n    return 0")


def resets_source(system: System) -> str:
    """Return the source of `resets(x, u, t, p, j, out) -> 0`, which fills `out` (events * states,) where one is set."""
    places = "".join(f"out[{place}], " for place, _ in system.settings)
    head = loaded(system, "resets(x, u, t, p, j, out)")
    return numbers_source(
        system, tuple(tree for _, tree in system.settings), head, f"{places}= {{numbers}},\n    return 0"
    )


def sides_at(system: System, x: FloatArray, u: FloatArray, start_s: float, p: FloatArray) -> FloatArray:
    """Return the signs (events, lanes) of what the events watch where a motion begins; 0: on zero, or no number.

    Args:
        system: The model.
        x: States (states, lanes) [SI].
        u: Inputs (inputs,) [SI].
        start_s: Time [s].
        p: Parameters (parameters, lanes) [SI].
    """
    lanes = x.shape[1]
    places = Places(x.T, np.broadcast_to(u, (lanes, len(u))), np.full(lanes, start_s))
    values = values_at(system, places, p, terms_of_events(system))
    found = [np.broadcast_to(np.sign(evaluate(one.when, values)), lanes) for one in system.events]
    return np.nan_to_num(np.array(found, dtype=np.float64).reshape(len(system.events), lanes))
