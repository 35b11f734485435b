"""Events on the way of an estimator's points: where an expression passes zero, states are set anew.

The passage within a step is found by halving. An event that turns its expression back begins from just before the
passage, another one from just beyond it, so that each expression is on the side on which it goes on. Each point has its
events at its own times.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import called_kernel
from rtctl.estimators.equations.step import step

HALVINGS = 40
"""Halvings of a step between which a passage lies: 1e-12 of it."""
MOST_EVENTS = 100
"""Events of a point in a step, at most; then it waits for the next step."""
PROBE = 1e-3
"""Share of a step over which the slope of an expression is taken."""


class Held(NamedTuple):
    """What does not change while points move."""

    u: FloatArray
    """Inputs (inputs,) [SI]."""
    p: FloatArray
    """Parameters (parameters,) [SI]."""
    low: FloatArray
    """Lower limits (n,) of the states [SI]."""
    high: FloatArray
    directions: FloatArray
    """Which way each event counts (events,)."""
    step_s: float


class Room(NamedTuple):
    """Arrays that a step needs."""

    k: FloatArray
    """(4 * n,)."""
    x: FloatArray
    """Of a stage, after a step, after an event: (3, n)."""
    g: FloatArray
    """(events,)."""
    fires: FloatArray
    """(events,): 1 for an event that takes place."""
    sets: FloatArray
    """(events * n,)."""


@called_kernel
def _mark(side: FloatArray, held: Held, room: Room) -> int:
    """Mark the events whose expressions `room.g` are beyond zero, and return the first; -1: none."""
    first = -1
    for e in range(side.shape[0]):
        beyond = side[e] * room.g[e] < 0.0 and side[e] * held.directions[e] <= 0.0
        room.fires[e] = 1.0 if beyond else 0.0
        first = e if beyond and first < 0 else first
    return first


@called_kernel
def _try(law: Any, guards: Any, x: FloatArray, held: Held, room: Room, time_s: float) -> None:
    """Fill `room.x[1]` and `room.g` with the states and expressions after a step of `time_s` [s] from `x` (n,)."""
    step(law, x, held.u, held.p, held.low, held.high, time_s, room.k, room.x[0], room.x[1])
    guards(room.x[1], held.u, held.p, room.g)


@called_kernel
def _slope(law: Any, guards: Any, x: FloatArray, held: Held, room: Room, e: int) -> float:
    """Return the change of an expression along the rates at `x` (n,) over `PROBE` of a step."""
    law(x, held.u, held.p, room.k[0 : x.shape[0]])
    for i in range(x.shape[0]):
        room.x[0, i] = x[i] + PROBE * held.step_s * room.k[i]
    guards(x, held.u, held.p, room.g)
    before = room.g[e]
    guards(room.x[0], held.u, held.p, room.g)
    change: float = room.g[e] - before
    return change


@called_kernel
def _set_states(resets: Any, x: FloatArray, held: Held, room: Room) -> None:
    """Fill `room.x[2]` with the states after the events that take place at `x` (n,)."""
    n = x.shape[0]
    for i in range(room.sets.shape[0]):
        room.sets[i] = np.nan
    resets(x, held.u, held.p, room.sets)
    for i in range(n):
        room.x[2, i] = x[i]
        for e in range(room.fires.shape[0]):
            value = room.sets[e * n + i]
            if room.fires[e] > 0.0 and not np.isnan(value):
                room.x[2, i] = min(max(value, held.low[i]), held.high[i])


# 9 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def _passage(  # noqa: PLR0913
    law: Any, guards: Any, resets: Any, x: FloatArray, side: FloatArray, held: Held, room: Room, left_s: float
) -> float:  # fmt: skip
    """Return the time [s] to the first event within `left_s` [s], and fill `room.x[2]` with the states after it.

    The step of `left_s` ends beyond it.
    """
    before_s, beyond_s = 0.0, left_s
    for _ in range(HALVINGS):
        half_s = 0.5 * (before_s + beyond_s)
        _try(law, guards, x, held, room, half_s)
        if _mark(side, held, room) < 0:
            before_s = half_s
        else:
            beyond_s = half_s
    _try(law, guards, x, held, room, beyond_s)
    e = _mark(side, held, room)
    _set_states(resets, room.x[1], held, room)
    if not side[e] * _slope(law, guards, room.x[2], held, room, e) > 0.0:
        return beyond_s
    _try(law, guards, x, held, room, before_s)
    _set_states(resets, room.x[1], held, room)
    return before_s


@called_kernel
def _step_with_events(
    law: Any, guards: Any, resets: Any, x: FloatArray, side: FloatArray, held: Held, room: Room
) -> None:
    """Move `x` (n,) through one step, in place."""
    left_s = held.step_s
    for _ in range(MOST_EVENTS):
        guards(x, held.u, held.p, room.g)
        if _mark(side, held, room) >= 0:  # an input or another event made it jump
            _set_states(resets, x, held, room)
        else:
            for e in range(side.shape[0]):
                if side[e] == 0.0:
                    side[e] = np.sign(_slope(law, guards, x, held, room, e))
            _try(law, guards, x, held, room, left_s)
            if _mark(side, held, room) < 0:
                for i in range(x.shape[0]):
                    x[i] = room.x[1, i]
                for e in range(side.shape[0]):
                    side[e] = side[e] if room.g[e] == 0.0 or np.isnan(room.g[e]) else np.sign(room.g[e])
                return
            left_s -= _passage(law, guards, resets, x, side, held, room, left_s)
        for i in range(x.shape[0]):
            x[i] = room.x[2, i]
        guards(x, held.u, held.p, room.g)
        for e in range(side.shape[0]):
            if room.fires[e] > 0.0:
                side[e] = np.sign(room.g[e])


# 12 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def advance_with_events(  # noqa: PLR0913
    law: Any, guards: Any, resets: Any, directions: FloatArray, points: FloatArray, sides: FloatArray, u: FloatArray,
    p: FloatArray, low: FloatArray, high: FloatArray, step_s: float, steps: int,
) -> None:  # fmt: skip
    """Move points through held inputs and events, in place.

    Args:
        law: Rates of the model.
        guards: What its events watch.
        resets: What they set.
        directions: Which way each counts (events,).
        points: States (points, n) [SI].
        sides: Sides (points, events) of the expressions so far; brought up to date.
        u: Inputs (inputs,) [SI].
        p: Parameters (parameters,) [SI].
        low: Lower limits (n,) of the states [SI].
        high: Upper limits (n,) [SI].
        step_s: Step [s].
        steps: Number of steps.
    """
    (m, n), events = points.shape, sides.shape[1]
    held = Held(u, p, low, high, directions, step_s)
    room = Room(np.empty(4 * n), np.empty((3, n)), np.empty(events), np.empty(events), np.empty(events * n))
    for j in range(m):
        for _ in range(steps):
            _step_with_events(law, guards, resets, points[j], sides[j], held, room)
