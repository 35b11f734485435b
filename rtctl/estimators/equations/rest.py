"""Where a user's equations rest: under held commands, or at a value of the controlled output."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.estimators.equations.flow import move, sides_at

LEFT_OVER = 1e-4
"""Step that a search still wants to take where it found a point of rest, as a share of what it has moved and is at."""


STILL = 1e-9
"""Rate of a mode at rest, over the fastest rate."""
SWEEP = 20.0
"""Slowest time constants that a sweep of the command takes."""
STEP_SHARE = 0.5
"""Step of an integration times the fastest rate of the equations."""
PLACES = 400
"""Levels of a sweep, one way."""
MOST_STEPS = 2_000_000
"""Steps of a sweep, most: where rates are further apart, it is faster than the slowest of them asks for."""
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
    side: int = 0
    """+1 or -1 where the command rose or fell before, which matters with hysteresis; 0: no matter."""


def state_at_rest(model: StateSpace, levels: Sequence[float]) -> FloatArray:
    """Return the states (n,) [SI] at which `levels` hold the device; the initial ones where it rests nowhere near."""
    start, rows = model.initial, _row_sizes(model, levels)
    found = _solved(
        lambda x: model.rates(_unswitched(model, x)[None], levels)[0] / rows, _off_limits(model), model
    )
    return _unswitched(model, found) if found is not None else start.copy()


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
        there, command = _unswitched(model, unknown[1:])[None], (levels[0] + unknown[0] * swing, *others)
        off = model.controlled(there, command) - output
        return np.concatenate((model.rates(there, command)[0] / rows, off))

    found = _solved(missed, np.concatenate(([0.0], begin)), model)
    if found is None:
        return RestPoint(begin, levels[0], holds=False)
    return RestPoint(_unswitched(model, found[1:]), float(levels[0] + found[0] * swing), holds=True)


def swept_points(
    model: StateSpace, levels: Sequence[float], span: tuple[float, float], outputs: Sequence[float]
) -> list[RestPoint]:
    """Return where the controlled output is nearest to `outputs` while the first command moves slowly up and down.

    Equations with hysteresis rest anywhere: which of these points is reached, a slow motion tells.

    Args:
        model: The equations.
        levels: All commands; the first one is swept.
        span: Lowest and highest level of the first command [its unit].
        outputs: Values of the controlled output [its unit].

    Returns:
        Where it rests after a stop on the way up and on the way down, for each value that is passed there.
    """
    fastest, slowest = rates_of(model)
    dwell_s = min(SWEEP / slowest, STEP_SHARE * MOST_STEPS / fastest) / PLACES
    steps = max(1, math.ceil(dwell_s * fastest / STEP_SHARE))
    x, step_s, found = model.initial[None].copy(), dwell_s / steps, []
    way = sides_at(model, x, (span[0], *levels[1:]))
    for side, ramp in ((1, np.linspace(*span, PLACES)), (-1, np.linspace(*span[::-1], PLACES))):
        states, shown = [], []
        for level in ramp:
            command = (float(level), *levels[1:])
            move(model, x, way, command, step_s, steps)
            states.append(x[0].copy())
            shown.append(float(model.controlled(x, command)[0]))
        passed = np.asarray(shown)
        for output in outputs:
            if passed.min() <= output <= passed.max():
                k = int(np.abs(passed - output).argmin())
                command = (float(ramp[k]), *levels[1:])
                found.append(_held(model, states[k], command, side, step_s, PLACES * steps))
    return found


# 6 parameters because a motion is a start, a command, and steps
def _held(
    model: StateSpace, x: FloatArray, levels: Sequence[float], side: int, step_s: float, steps: int
) -> RestPoint:
    """Return where the device rests once `levels` were held for `steps` from the states `x` (n,) on."""
    rest = x[None].copy()
    move(model, rest, sides_at(model, rest, levels), levels, step_s, steps)
    return RestPoint(rest[0], levels[0], holds=True, side=side)


def rates_of(model: StateSpace) -> tuple[float, float]:
    """Return the fastest and the slowest rate [1/s] of the equations where the device rests without commands."""
    levels = (0.0,) * len(model.profile.commands)
    found = np.abs(np.linalg.eigvals(np.nan_to_num(jacobian(model, state_at_rest(model, levels), levels))))
    fastest = float(found.max()) or 1.0
    moving = found[found > STILL * fastest]
    return fastest, float(moving.min()) if len(moving) else fastest


def rests_anywhere(model: StateSpace, point: RestPoint, levels: Sequence[float]) -> bool:
    """Return whether the equations also rest beside a point: a mode there neither decays nor moves."""
    found = np.abs(np.linalg.eigvals(np.nan_to_num(jacobian(model, point.x, (point.level, *levels[1:])))))
    return bool(found.min() <= STILL * found.max())


def jacobian(model: StateSpace, x: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Return the slopes (n, n) [1/s, in SI] of the rates at states `x` (n,)."""
    steps = SHARE * np.maximum(np.abs(x), SHARE)
    moved = np.concatenate((x + np.diag(steps), x - np.diag(steps)))
    up, down = np.split(model.rates(moved, levels), 2)
    return np.asarray(((up - down) / (2.0 * steps[:, None])).T)


def _unswitched(model: StateSpace, x: FloatArray) -> FloatArray:
    """Return states (n,) with those that events alone change as they are at the start: they rest by themselves."""
    return np.where(model.switched, model.initial, x)


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
