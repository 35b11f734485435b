"""Finite differences of the outputs, with the largest step that still gives a derivative."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.subject import FittedRecords


class DifferenceChecks(NamedTuple):
    """Which finite differences (lanes, outputs, n) may be used."""

    small: NDArray[np.bool_]
    """(lanes,) True where the difference is small enough to be a derivative."""
    usable: NDArray[np.bool_]
    """(lanes,) True where it is near one: the motion did not escape to another branch."""


def check_differences(
    differences: FloatArray, problem: FittedRecords, outputs: Sequence[str]
) -> DifferenceChecks:
    """Compare differences with the size of the motion.

    Args:
        differences: Changes of the outputs by a step, (lanes, outputs, n), in their units.
        problem: Problem with the sizes of the outputs.
        outputs: Names of the outputs.
    """
    sizes = np.array([problem.size(name) for name in outputs])
    with np.errstate(invalid="ignore", over="ignore"):
        largest = np.abs(differences).max(axis=2) / sizes
        return DifferenceChecks(
            (largest < problem.subject.difference_steps.small).all(axis=1),
            (largest < problem.thresholds.problem.largest_move).all(axis=1),
        )


def differentiate(
    difference: Callable[[float], FloatArray], problem: FittedRecords, outputs: Sequence[str]
) -> FloatArray | float:
    """Return the derivative (outputs, n) along one direction, or 0 where no step of the subject resolves it.

    Args:
        difference: Function of a step that returns the change of the outputs by it, (outputs, n).
        problem: Problem whose subject has the steps to try, the largest first.
        outputs: Names of the outputs.
    """
    derivative: FloatArray | float = 0.0
    for step in problem.subject.difference_steps.sizes:
        change = difference(step)
        checks = check_differences(change[None], problem, outputs)
        if checks.usable[0]:
            derivative = change / step
        if checks.small[0]:
            break
    return derivative
