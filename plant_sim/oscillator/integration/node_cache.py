"""The drive between samples, kept while a fit simulates one record again and again."""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict, deque
from functools import partial

import numpy as np

from plant_sim.oscillator.integration.holds import compiled, nodes
from plant_sim.oscillator.mechanism import Sampled
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus

MOST_BYTES = 256 * 2**20
Key = tuple[object, ...]


class Kept:
    """What was made last of each record, as far as memory allows; a record that is gone takes its own along.

    A fit of short segments keeps tens of thousands of arrays, so nothing here looks at all of them.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most, self._bytes = most_bytes, 0
        self._of: OrderedDict[Key, tuple[weakref.ref[Stimulus], FloatArray]] = OrderedDict()
        self._gone: deque[Key] = deque()  # a record may end in any thread, also while this one is locked
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._of)

    def find(self, key: Key, owner: Stimulus) -> FloatArray | None:
        """Return what is kept of a record under a key."""
        with self._lock:
            kept = self._of.get(key)
            if kept is None or kept[0]() is not owner:
                return None
            self._of.move_to_end(key)
            return kept[1]

    def keep(self, key: Key, owner: Stimulus, values: FloatArray) -> None:
        """Keep values of a record, and let go of those that were asked for longest ago."""
        with self._lock:
            while self._gone:
                gone = self._gone.popleft()
                if gone in self._of and self._of[gone][0]() is None:  # not another record's by now
                    self._drop(gone)
            self._drop(key)
            self._of[key] = weakref.ref(owner, partial(self._end, key)), values
            self._bytes += values.nbytes
            while self._bytes > self._most and len(self._of) > 1:
                self._drop(next(iter(self._of)))

    def _end(self, key: Key, _: weakref.ref[Stimulus]) -> None:
        self._gone.append(key)

    def _drop(self, key: Key) -> None:
        kept = self._of.pop(key, None)
        if kept is not None:
            self._bytes -= kept[1].nbytes


_kept = Kept(MOST_BYTES)


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
    kept = _kept.find(key, stimulus)
    if kept is not None:
        return kept
    onward = drive.onward if len(drive.onward) or not beyond else drive.samples[-1:]
    made = nodes(
        np.concatenate((drive.samples, onward)), drive.hold, substeps, drive.delay_s / drive.period_s,
        within=drive.within,
    )  # fmt: skip
    made = made[: (len(drive.samples) - 1 + beyond) * substeps]
    made.setflags(write=False)
    _kept.keep(key, stimulus, made)
    return made


@compiled
def _move_towards(made: FloatArray, weight: float, other: FloatArray, declared: FloatArray) -> None:
    """Return made + weight (other - declared), in one pass through the memory."""
    for i in range(len(made)):
        for c in range(3):
            made[i, c] += weight * (other[i, c] - declared[i, c])
