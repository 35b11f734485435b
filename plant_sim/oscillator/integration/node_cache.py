"""The drive between samples, kept while a fit simulates one record again and again."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict

import numpy as np

from plant_sim.oscillator.integration.holds import compiled, nodes
from plant_sim.oscillator.mechanism import Sampled
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus

MOST_BYTES = 256 * 2**20
_kept: OrderedDict[tuple[object, ...], tuple[weakref.ref[Stimulus], FloatArray]] = OrderedDict()
_lock = threading.Lock()


def cached(
    stimulus: Stimulus, drive: Sampled, substeps: int, name: str = "drive", beyond: int = 0
) -> FloatArray:
    """Return the input `name` (steps, 3) at the integrator's instants, to `beyond` samples after the last.

    It is not to be written to.

    Of a blend its holds are kept: its weights are what a fit changes.
    """
    if drive.blend:
        declared = cached(stimulus, drive._replace(blend=()), substeps, name, beyond)
        made = declared.copy()
        for hold, weight in drive.blend:
            other = cached(stimulus, drive._replace(hold=hold, blend=()), substeps, name, beyond)
            _move_towards(made, weight, other, declared)
        return made
    key = (id(stimulus), name, drive.hold, drive.delay_s, drive.within, substeps, beyond)
    with _lock:
        kept = _kept.get(key)
        if kept is not None and kept[0]() is stimulus:
            _kept.move_to_end(key)
            return kept[1]
    onward = drive.onward if len(drive.onward) or not beyond else drive.samples[-1:]
    made = nodes(
        np.concatenate((drive.samples, onward)), drive.hold, substeps, drive.delay_s / drive.period_s,
        within=drive.within,
    )  # fmt: skip
    made = made[: (len(drive.samples) - 1 + beyond) * substeps]
    made.setflags(write=False)
    with _lock:
        for gone in [old for old, (owner, _) in _kept.items() if owner() is None]:
            del _kept[gone]
        _kept[key] = (weakref.ref(stimulus), made)
        while sum(values.nbytes for _, values in _kept.values()) > MOST_BYTES and len(_kept) > 1:
            _kept.popitem(last=False)
    return made


@compiled
def _move_towards(made: FloatArray, weight: float, other: FloatArray, declared: FloatArray) -> None:
    """Return made + weight (other - declared), in one pass through the memory."""
    for i in range(len(made)):
        for c in range(3):
            made[i, c] += weight * (other[i, c] - declared[i, c])
