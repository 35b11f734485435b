"""Inputs at the instants of an integrator's steps, kept while a fit simulates one record again and again."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict

import numpy as np

from plant_sim.equations.system import System
from plant_sim.oscillator.integration.holds import nodes
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus

MOST_BYTES = 256 * 2**20
_kept: OrderedDict[tuple[int, int, int], tuple[weakref.ref[Stimulus], weakref.ref[System], FloatArray]] = (
    OrderedDict()
)
_lock = threading.Lock()


def input_nodes(stimulus: Stimulus, system: System, factors: FloatArray, substeps: int) -> FloatArray:
    """Return the inputs (3, steps, inputs) [SI] at the start, middle and end of each step; not to be written to.

    Args:
        stimulus: Record with all inputs of the system.
        system: Names the inputs.
        factors: SI units (inputs,) of each input's unit in the record.
        substeps: Steps between two samples.
    """
    key = (id(stimulus), id(system), substeps)
    with _lock:
        kept = _kept.get(key)
        if kept is not None and kept[0]() is stimulus and kept[1]() is system:
            _kept.move_to_end(key)
            return kept[2]
    made = np.empty((3, (stimulus.samples - 1) * substeps, len(system.inputs)))
    for k, one in enumerate(system.inputs):
        samples = np.concatenate((stimulus.inputs[one.name], stimulus.onward.get(one.name, np.empty(0))))
        found = nodes(samples, stimulus.holds.get(one.name, "linear"), substeps)[: made.shape[1]]
        made[:, :, k] = factors[k] * found.T
    made.setflags(write=False)
    with _lock:
        for gone in [old for old, (owner, _, _) in _kept.items() if owner() is None]:
            del _kept[gone]
        _kept[key] = (weakref.ref(stimulus), weakref.ref(system), made)
        while sum(entry[2].nbytes for entry in _kept.values()) > MOST_BYTES and len(_kept) > 1:
            _kept.popitem(last=False)
    return made
