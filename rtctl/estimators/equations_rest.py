"""Where a user's equations rest: under held commands, or at a value of the controlled output."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace

LEFT_OVER = 1e-4
"""Step that a search still wants to take where it found a point of rest, as a share of what it has moved and is at."""


SHARE = 1e-6
"""Step of a finite difference, as a share of a state."""


class RestPoint(NamedTuple):
    """A point at which nothing moves."""

    x: FloatArray
    """States (n,) [SI]."""
    level: float
    """First command [its unit]."""
    holds: bool
    """Whether one was found; else these are the initial states."""


def state_at_rest(model: StateSpace, levels: Sequence[float]) -> FloatArray:
    """Return the states (n,) [SI] at which `levels` hold the device; the initial ones where it rests nowhere near."""
    start, rows = model.initial, _row_sizes(model, levels)
    found = _solved(lambda x: model.rates(x[None], levels)[0] / rows, _off_limits(model), model)
    return found if found is not None else start.copy()


def rest_point(model: StateSpace, levels: Sequence[float], output: float, swing: float) -> RestPoint:
    """Return where the device rests with the controlled output at `output` [its unit], by its first command.

    Args:
        model: The equations.
        levels: All commands; the first is where the search starts.
        output: Value of the controlled output.
        swing: Range of the first command [its unit].
    """
    others, rows = tuple(levels[1:]), _row_sizes(model, levels)
    begin = _off_limits(model)

    def missed(unknown: FloatArray) -> FloatArray:
        there, command = unknown[None, 1:], (levels[0] + unknown[0] * swing, *others)
        off = model.controlled(there, command) - output
        return np.concatenate((model.rates(there, command)[0] / rows, off))

    found = _solved(missed, np.concatenate(([0.0], begin)), model)
    if found is None:
        return RestPoint(begin, levels[0], holds=False)
    return RestPoint(found[1:], float(levels[0] + found[0] * swing), holds=True)


def jacobian(model: StateSpace, x: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Return the slopes (n, n) [1/s, in SI] of the rates at states `x` (n,)."""
    steps = SHARE * np.maximum(np.abs(x), SHARE)
    moved = np.concatenate((x + np.diag(steps), x - np.diag(steps)))
    up, down = np.split(model.rates(moved, levels), 2)
    return np.asarray(((up - down) / (2.0 * steps[:, None])).T)


def _row_sizes(model: StateSpace, levels: Sequence[float]) -> FloatArray:
    """Return the largest slope (n,) of each rate at the start, 1 where it has none."""
    largest = np.abs(np.nan_to_num(jacobian(model, _off_limits(model), levels))).max(axis=1)
    return np.where(largest > 0.0, largest, 1.0)


def _off_limits(model: StateSpace) -> FloatArray:
    """Return the initial states (n,), moved a little from a limit at which a rate may have no slope."""
    room = np.where(
        np.isfinite(model.high - model.low), model.high - model.low, np.maximum(np.abs(model.initial), 1.0)
    )
    return np.clip(model.initial, model.low + SHARE * room, model.high - SHARE * room)


def _solved(
    missed: Callable[[FloatArray], FloatArray], begin: FloatArray, model: StateSpace
) -> FloatArray | None:
    """Return where `missed` is zero; None where the search ends elsewhere. The last unknowns are the states."""
    free = len(begin) - len(model.low)
    low, high = (
        np.concatenate((np.full(free, end), limit))
        for end, limit in ((-np.inf, model.low), (np.inf, model.high))
    )
    with np.errstate(all="ignore"):
        try:
            found = least_squares(
                missed, begin, bounds=(low, high), x_scale="jac", xtol=1e-12, ftol=1e-15, gtol=1e-15
            )
        except ValueError:  # not finite at the start
            return None
        left = np.linalg.lstsq(np.asarray(found.jac), np.asarray(found.fun), rcond=None)[0]
    reached = np.abs(left) <= LEFT_OVER * (np.abs(found.x) + np.abs(found.x - begin)) + 1e-12
    residual = np.abs(found.fun - found.jac @ left).max() <= LEFT_OVER * max(
        float(np.abs(missed(begin)).max()), 1e-9
    )
    return np.asarray(found.x) if bool(reached.all()) and bool(residual) else None
