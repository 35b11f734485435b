"""How far a finite difference goes, and whether it was one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.subject import FittedRecords

LARGEST_MOVE = 0.3
"""Of the outputs' RMS, by one step: beyond it the motion has escaped, or turned chaotic."""


class Moves(NamedTuple):
    """Of differences (lanes, outputs, n), which are what."""

    small: NDArray[np.bool_]
    """(lanes,): a derivative."""
    usable: NDArray[np.bool_]
    """(lanes,): one, or near it: no escape."""


def moves(moved: FloatArray, problem: FittedRecords, outputs: Sequence[str]) -> Moves:
    """How far differences (lanes, outputs, n) go beside the motion."""
    sizes = np.array([problem.size(name) for name in outputs])
    with np.errstate(invalid="ignore", over="ignore"):
        largest = np.abs(moved).max(axis=2) / sizes
        return Moves(
            (largest < problem.subject.steps.small).all(axis=1), (largest < LARGEST_MOVE).all(axis=1)
        )


def slope(
    moved: Callable[[float], FloatArray], problem: FittedRecords, outputs: Sequence[str], otherwise: float
) -> FloatArray | float:
    """(outputs, n) from what a step moves, `moved(step)` (outputs, n); `otherwise` where the motion escapes by any."""
    found: FloatArray | float = otherwise
    for step in problem.subject.steps.sizes:
        difference = moved(step)
        far = moves(difference[None], problem, outputs)
        if far.usable[0]:
            found = difference / step
        if far.small[0]:
            break
    return found
