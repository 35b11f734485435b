"""A drive changed value by value: each depends on nothing but the drive at that instant."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from plant_sim.oscillator.mechanism import Driven
from rtctl.border.arrays import FloatArray

BLOCK_STEPS = 4096
"""Values changed at once: 100 kB, so that numpy's intermediate results stay in the cache."""


def pointwise(drive: Driven, function: Callable[[FloatArray], FloatArray]) -> Driven:
    """Return `function` of the drive at every instant."""
    changed = np.empty_like(drive.nodes)
    for first in range(0, len(changed), BLOCK_STEPS):
        rows = slice(first, first + BLOCK_STEPS)
        changed[rows] = function(drive.nodes[rows])
    return drive._replace(nodes=changed)
