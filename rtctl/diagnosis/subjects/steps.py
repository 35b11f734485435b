"""How far a finite difference goes, and whether it was one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rtctl.diagnosis.hypothesis import Data

FloatArray = NDArray[np.float64]
STEP = 1e-4
"""Of a parameter's scale: friction and deadbands have no derivative at 0, only a slope over a small step."""
STEPS = (STEP, 1e-7)
"""The second where the first lets the motion escape or turn chaotic."""
LARGEST_MOVE = 0.3
"""Of the outputs' RMS, by one step."""


def tame(moved: FloatArray, data: Data, outputs: Sequence[str]) -> NDArray[np.bool_]:
    """(lanes,) of which differences (lanes, outputs, n) are small beside the motion: a derivative, not an escape."""
    sizes = np.array([data.size(name) for name in outputs])
    with np.errstate(invalid="ignore", over="ignore"):
        largest = np.abs(moved).max(axis=2) / sizes
        found: NDArray[np.bool_] = (largest < LARGEST_MOVE).all(axis=1)
    return found
