"""The identified read-outs along a path of temperatures that visits more than the samples.

Only turning points and samples move the relays: between them a Preisach model forgets the way, so the course within a
sample period costs nothing where the temperature rises or falls throughout.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, uncounted
from rtctl.hysteresis.preisach.model import (
    MAX_EXTREMA,
    PreisachParams,
    cooled_stack,
    preisach_step,
    uncounted_params,
)


class ReadOut(NamedTuple):
    """Reading y and the part of it from the relays, one value every `every` instants."""

    y: FloatArray
    relays: FloatArray


@background_kernel
def read_path(
    state: FloatArray, seen: FloatArray, peaks: FloatArray, every: int, params: PreisachParams
) -> ReadOut:
    """Return the read-out at `seen` by way of `peaks` (both (instants,) [mA]). Advances `state` in place."""
    state, params = uncounted(state), uncounted_params(params)
    count = (seen.size - 1) // every + 1
    y, relays = np.empty(count), np.empty(count)
    top = 1 + MAX_EXTREMA
    for k in range(seen.size):
        if peaks[k] != seen[k]:
            preisach_step(state, peaks[k], params)
        if k % every != 0 and (seen[k] - seen[k - 1]) * (seen[k + 1] - seen[k]) >= 0.0:
            continue
        value = preisach_step(state, seen[k], params).y
        if k % every == 0:
            y[k // every] = value
            relays[k // every] = params.sign * state[top + int(state[0])]
    return ReadOut(y, relays)


def follow(seen: FloatArray, peaks: FloatArray, every: int, params: PreisachParams) -> ReadOut:
    """Apply `read_path` from the branch that a full cooling leaves."""
    return read_path(cooled_stack(params.grid), seen, peaks, every, params)
