"""States of a user's equations one sample later, for many points at once, also through events."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.border.kernels import kernel
from rtctl.estimators.equations.laws import laws_of
from rtctl.estimators.equations.passages import advance_with_events
from rtctl.estimators.equations.step import step


# 8 parameters because a compiled kernel takes its arrays one by one
@kernel
def advance(  # noqa: PLR0913
    rates: Any,
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
        rates: Rates of the model (`rtctl.estimators.equations.laws.Laws`).
        points: States (points, n) [SI].
        u: Inputs (inputs,) [SI].
        p: Parameters (parameters,) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        step_s: Step [s].
        steps: Number of steps.
    """
    m, n = points.shape
    k, there = np.empty(4 * n), np.empty(n)
    for j in range(m):
        x = points[j]
        for _ in range(steps):
            step(rates, x, u, p, low, high, step_s, k, there, x)


def watched_at(model: StateSpace, points: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Return the expressions (points, events) that the events of a model watch; 0 where one has no value."""
    found, u = np.empty((len(points), len(model.directions))), model.input_si(levels)
    if found.size:
        guards = laws_of(model).guards
        for row, x in zip(found, points, strict=True):
            guards(np.ascontiguousarray(x), u, model.parameters, row)
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
    u, laws = model.input_si(levels), laws_of(model)
    if len(model.directions) == 0:
        advance(laws.rates, points, u, model.parameters, model.low, model.high, step_s, steps)
        return
    advance_with_events(
        laws.rates, laws.guards, laws.resets, laws.directions, points, sides, u, model.parameters, model.low,
        model.high, step_s, steps,
    )  # fmt: skip
