"""States of a user's equations one sample later, for many points at once: Runge-Kutta steps of order 4, on their own.

The estimator integrates by itself: an error in the simulated device's integrator must not cancel in a loop's test.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.border.kernels import kernel
from rtctl.estimators.equations.passages import advance_with_events
from rtctl.estimators.equations.step import step


# 8 parameters because a compiled kernel takes its arrays one by one
@kernel
def advance(  # noqa: PLR0913
    law: Any,
    points: FloatArray,
    u: FloatArray,
    p: FloatArray,
    low: FloatArray,
    high: FloatArray,
    step_s: float,
    steps: int,
) -> None:
    """Move points through held inputs, in place.

    Args:
        law: Rates of the model (`rtctl.border.equations.controlled.StateSpace.law`).
        points: States (points, n) [SI].
        u: Inputs (inputs,) [SI].
        p: Parameters (parameters, 1) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        step_s: Step [s].
        steps: Number of steps.
    """
    m, n = points.shape
    k, there = np.empty((4, n)), np.empty(n)
    for j in range(m):
        x = points[j]
        for _ in range(steps):
            step(law, x, u, p, low, high, step_s, k, there, x)


def watched_at(model: StateSpace, points: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Return the expressions (points, events) that the events of a model watch; 0 where one has no value."""
    if model.passages is None:
        return np.empty((len(points), 0))
    found, u = np.empty((len(points), len(model.passages.directions))), model.input_si(levels)
    for row, x in zip(found, points, strict=True):
        model.passages.guards(np.ascontiguousarray(x), u, 0.0, model.parameters, 0, row)
    return np.nan_to_num(found)


def sides_at(model: StateSpace, points: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Return on which side of zero (points, events) these expressions are; 0: on it."""
    return np.sign(watched_at(model, points, levels))


# 6 parameters because a motion is a start, a command, and steps
def move(
    model: StateSpace,
    points: FloatArray,
    sides: FloatArray,
    levels: Sequence[float],
    step_s: float,
    steps: int,
) -> None:
    """Move points (points, n) [SI] through held commands and through the events of the model, in place.

    Args:
        model: The equations.
        points: States.
        sides: Sides (points, events) so far, see `sides_at`; brought up to date.
        levels: Commands.
        step_s: Step [s].
        steps: Number of steps.
    """
    u, found = model.input_si(levels), model.passages
    if found is None:
        advance(model.law, points, u, model.parameters, model.low, model.high, step_s, steps)
        return
    advance_with_events(
        model.law, *found, points, sides, u, model.parameters, model.low, model.high, step_s, steps
    )
