"""Events within a step: where an expression passes zero, states are set anew, and the step goes on from there.

A step is tried as a whole. If an event's expression g is beyond zero at its end, the share s of the step at which it
passes is enclosed by ITP, each trial being a step of the integrator's own kind up to s. The values after the event are
taken on the side of the passage on which the motion goes on: beyond it where g passes through, before it where the
event turns g back, as a bounce does. So each g has the sign that its motion has, however short the next flight is.

What jumps past zero, because an input or another event made it jump, is an event at once. An event does not follow
from a state that begins beyond zero.

References: Oliveira, Takahashi, ACM Trans. Math. Software 47 (2020) 5 (ITP); Modelica Language Specification 3.6,
8.3.5 (`when`, `reinit`), whose values just before an event are those that `set` reads.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from plant_sim.equations.compiled.implicit import at_share, lane_step
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, called_kernel, first_class

LOCATED = 1e-12
"""Width to which the share of a step is enclosed at which an expression passes zero."""
MOST_EVENTS = 1000
"""Events of one lane in a step beyond which they are taken to follow each other without end."""
PROBE = 1e-3
"""Share of a step over which the slope of an expression is taken."""
CURVATURE, SLACK = 0.2, 1.0
"""Constants kappa1 and n0 of ITP; kappa2 is 2."""
FARTHEST = 1e300
"""Value beyond which an expression is taken to be no larger, so that a line can be drawn."""


class Laws(NamedTuple):
    """Compiled laws of a model, each `law(x, u, t, p, j, out) -> 0` with x (states,) and u (inputs,) in SI."""

    rates: Any
    """out (states,)."""
    guards: Any
    """out (events,): the expressions that pass zero."""
    resets: Any
    """out (events * states,): the states after each event; what an event leaves is not filled."""
    directions: FloatArray
    """Directions (events,), see `plant_sim.equations.system.Event`."""


class Step(NamedTuple):
    """One step of one lane."""

    nodes: FloatArray
    """Inputs (3, steps, inputs) [SI]."""
    i: int
    """Number of the step."""
    h: float
    """Its length [s]."""
    t: float
    """Time at which it begins [s]."""
    p: FloatArray
    """Parameters (parameters, lanes) [SI]."""
    j: int
    """Number of the lane."""
    low: FloatArray
    """Limits (states,) [SI]."""
    high: FloatArray
    implicit: bool
    """Whether steps are those for stiff models."""


class Scratch(NamedTuple):
    """Arrays that a step needs."""

    k: FloatArray
    """Rates (4, states), and a place."""
    u: FloatArray
    """Inputs (inputs,)."""
    g: FloatArray
    """Expressions (3, events): where events take place, of a trial, of a probe."""
    sets: FloatArray
    """States after each event (events * states,)."""
    fires: FloatArray
    """1 for an event (events,) that takes place."""
    x: FloatArray
    """States (3, states): where events take place, of a trial, after the events."""


@called_kernel
def make_scratch(states: int, inputs: int, events: int) -> Scratch:
    """Return the arrays."""
    return Scratch(
        np.empty((5, states)), np.empty(inputs), np.empty((3, events)), np.empty(events * states),
        np.empty(events), np.empty((3, states)),
    )  # fmt: skip


@called_kernel
def _copy(source: FloatArray, target: FloatArray) -> None:
    """Copy (n,) numbers: a slice is checked, and the words of its error take seconds to compile."""
    for k in range(target.shape[0]):
        target[k] = source[k]


@called_kernel
def _explicit(rates: Any, one: Step, own: Scratch, x: FloatArray, begin: float, end: float) -> None:
    """Move `x` (states,) from share `begin` of the step to `end` by one Runge-Kutta step of order 4."""
    n, h, t = x.shape[0], (end - begin) * one.h, one.t + begin * one.h
    for stage in range(4):
        share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        for r in range(n):
            own.k[4, r] = x[r] + (share * h * own.k[stage - 1, r] if stage > 0 else 0.0)
        at_share(one.nodes, one.i, begin + share * (end - begin), own.u)
        rates(own.k[4], own.u, t + share * h, one.p, one.j, own.k[stage])
    for r in range(n):
        x[r] += h / 6.0 * (own.k[0, r] + 2.0 * (own.k[1, r] + own.k[2, r]) + own.k[3, r])


@called_kernel
def _within(x: FloatArray, one: Step) -> None:
    """Put states (states,) back that are beyond a limit."""
    for r in range(x.shape[0]):
        x[r] = min(max(x[r], one.low[r]), one.high[r])


# 7 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def _move(
    rates: Any, one: Step, own: Scratch, x: FloatArray, begin: float, end: float, moved: FloatArray
) -> int:
    """Fill `moved` (states,) with the states at share `end` of the step, from `x` (states,) at share `begin`."""
    if one.implicit:
        _copy(lane_step(rates, x, one.nodes, one.i, one.h, one.t, one.p, one.j, begin, end), moved)
    else:
        _copy(x, moved)
        _explicit(rates, one, own, moved, begin, end)
    _within(moved, one)
    return 0


@called_kernel
def _guard(guards: Any, one: Step, own: Scratch, x: FloatArray, share: float, g: FloatArray) -> None:
    """Fill `g` (events,) with the expressions at `x` (states,) and a share of the step."""
    at_share(one.nodes, one.i, share, own.u)
    guards(x, own.u, one.t + share * one.h, one.p, one.j, g)


@called_kernel
def _left(directions: FloatArray, side: FloatArray, g: FloatArray, j: int) -> float:
    """Return how far the nearest of the expressions `g` (events,) is from an event; < 0: it is beyond it."""
    least = math.inf
    for e in range(len(g)):
        if side[e, j] != 0.0 and side[e, j] * directions[e] <= 0.0:
            distance = side[e, j] * g[e]
            least = min(least, distance) if distance == distance else least
    return least


@called_kernel
def _slope(rates: Any, guards: Any, one: Step, own: Scratch, x: FloatArray, share: float, e: int) -> float:
    """Return the change of an expression along the rates at `x` (states,), over `PROBE` of the step."""
    at_share(one.nodes, one.i, share, own.u)
    rates(x, own.u, one.t + share * one.h, one.p, one.j, own.k[0])
    for r in range(x.shape[0]):
        own.k[4, r] = x[r] + PROBE * one.h * own.k[0, r]
    _guard(guards, one, own, x, share, own.g[1])
    _guard(guards, one, own, own.k[4], share + PROBE, own.g[2])
    change: float = own.g[2, e] - own.g[1, e]
    return change


@called_kernel
def _set_states(resets: Any, one: Step, own: Scratch, x: FloatArray, share: float) -> None:
    """Fill the states after all events that take place at `x` (states,)."""
    n, after = x.shape[0], own.x[2]
    for k in range(own.sets.shape[0]):
        own.sets[k] = math.nan
    at_share(one.nodes, one.i, share, own.u)
    resets(x, own.u, one.t + share * one.h, one.p, one.j, own.sets)
    for r in range(n):
        after[r] = x[r]
        for e in range(own.fires.shape[0]):
            if own.fires[e] > 0.0 and not math.isnan(own.sets[e * n + r]):
                after[r] = own.sets[e * n + r]
    _within(after, one)


@called_kernel
def _mark(directions: FloatArray, side: FloatArray, own: Scratch, j: int) -> int:
    """Mark which events take place with the expressions `own.g[0]`, and return the first; the others change sides."""
    first = -1
    for e in range(side.shape[0]):
        g, s = own.g[0, e], side[e, j]
        own.fires[e] = 1.0 if s * g < 0.0 and s * directions[e] <= 0.0 else 0.0
        if own.fires[e] > 0.0:
            first = e if first < 0 else first
        elif g != 0.0 and not math.isnan(g):
            side[e, j] = np.sign(g)
    return first


# 7 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def _settle(guards: Any, one: Step, own: Scratch, side: FloatArray, x: FloatArray, share: float) -> None:
    """Give each event that took place the side of its expression at the states `x` after it."""
    _guard(guards, one, own, x, share, own.g[1])
    for e in range(side.shape[0]):
        if own.fires[e] > 0.0:
            side[e, one.j] = np.sign(own.g[1, e])


# 8 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def _enclose(  # noqa: PLR0913
    rates: Any, guards: Any, directions: FloatArray, move: Any, one: Step, own: Scratch, side: FloatArray,
    x: FloatArray, begin: float, last: float,
) -> tuple[float, float]:  # fmt: skip
    """Return shares of the step between which the first event lies, `last` being what is left at its end (by ITP)."""
    _guard(guards, one, own, x, begin, own.g[1])
    a, b, at_a, at_b = begin, 1.0, max(_left(directions, side, own.g[1], one.j), 0.0), last
    width, here = b - a, own.x[1]
    halvings = max(0.0, math.ceil(math.log2(width / LOCATED))) + SLACK
    while b - a > LOCATED:
        half, most = 0.5 * (a + b), 0.5 * (LOCATED * 2.0**halvings - (b - a))
        found = (at_a * b - at_b * a) / (at_a - at_b)
        toward = 1.0 if half >= found else -1.0
        step = CURVATURE / width * (b - a) ** 2
        found = found + toward * step if step <= abs(half - found) else half
        if not abs(found - half) <= most:
            found = half - toward * most
        if not a < found < b or halvings < 0.0:
            found = half
        halvings -= 1.0
        move(rates, one, own, x, begin, found, here)
        _guard(guards, one, own, here, found, own.g[1])
        left = _left(directions, side, own.g[1], one.j)
        if left < 0.0:
            b, at_b = found, max(left, -FARTHEST)
        else:
            a, at_a = found, min(left, FARTHEST)
    return a, b


# 9 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def _to_event(  # noqa: PLR0913
    rates: Any, guards: Any, resets: Any, directions: FloatArray, move: Any, one: Step, own: Scratch,
    side: FloatArray, x: FloatArray, share: float,
) -> tuple[int, float]:  # fmt: skip
    """Go on from `x` (states,) at a share of the step: to its end, or to the first event and the states after it.

    Returns:
        The event, -1 where the step ends without one and `x` is moved there; and the share reached.
    """
    for e in range(side.shape[0]):
        if side[e, one.j] == 0.0:
            side[e, one.j] = np.sign(_slope(rates, guards, one, own, x, share, e))
    there = own.x[0]
    move(rates, one, own, x, share, 1.0, there)
    _guard(guards, one, own, there, 1.0, own.g[0])
    last = _left(directions, side, own.g[0], one.j)
    if not last < 0.0:
        _mark(directions, side, own, one.j)
        _copy(there, x)
        return -1, 1.0
    before, beyond = _enclose(rates, guards, directions, move, one, own, side, x, share, last)
    move(rates, one, own, x, share, beyond, there)
    _guard(guards, one, own, there, beyond, own.g[0])
    first = _mark(directions, side, own, one.j)
    _set_states(resets, one, own, there, beyond)
    if side[first, one.j] * _slope(rates, guards, one, own, own.x[2], beyond, first) <= 0.0:
        return first, beyond
    move(rates, one, own, x, share, before, there)  # it is turned back
    _guard(guards, one, own, there, before, own.g[0])
    _set_states(resets, one, own, there, before)
    return first, before


# 9 parameters because a compiled kernel takes its arrays one by one
@called_kernel
def carry(  # noqa: PLR0913
    rates: Any, guards: Any, resets: Any, directions: FloatArray, move: Any, one: Step, own: Scratch,
    side: FloatArray, x: FloatArray, endless: FloatArray,
) -> int:  # fmt: skip
    """Move `x` (states,) through a step and its events, in place; return 1, or 0 where they do not end.

    Args:
        rates: Law of `Laws`.
        guards: Law of `Laws`.
        resets: Law of `Laws`.
        directions: See `Laws`.
        move: `_move` by its address.
        one: Step and lane.
        own: Scratch arrays.
        side: Signs (events, lanes) of the expressions so far, 0 where one is on zero; brought up to date.
        x: States.
        endless: Event and time [s] (2,), filled where events do not end.
    """
    share, count = 0.0, 0
    while count <= MOST_EVENTS:
        _guard(guards, one, own, x, share, own.g[0])
        first = _mark(directions, side, own, one.j)
        if first >= 0:  # it jumped, because of an input or of another event
            _set_states(resets, one, own, x, share)
        elif share >= 1.0:
            return 1
        else:
            first, share = _to_event(rates, guards, resets, directions, move, one, own, side, x, share)
            if first < 0:
                return 1
        _copy(own.x[2], x)
        _settle(guards, one, own, side, x, share)
        count += 1
        endless[0], endless[1] = first, one.t + share * one.h
    return 0


# 13 parameters because a compiled kernel takes its arrays one by one
@background_kernel
def extrapolate_with_events(  # noqa: PLR0913
    rates: Any, guards: Any, resets: Any, directions: FloatArray, move: Any, carry: Any, x: FloatArray,
    nodes: FloatArray, h: float, substeps: int, start_s: float, p: FloatArray, low: FloatArray, high: FloatArray,
    side: FloatArray, endless: FloatArray, out: FloatArray,
) -> bool:  # fmt: skip
    """March all lanes through a record as `extrapolate` of `plant_sim.equations.compiled.implicit` does, with events.

    Further arguments are those of `carry`, which tells what is returned.
    """
    states, lanes = x.shape
    here, own = np.empty(states), make_scratch(states, nodes.shape[2], side.shape[0])
    for i in range(nodes.shape[1]):
        for j in range(lanes):
            for r in range(states):
                here[r] = x[r, j]
            one = Step(nodes, i, h, start_s + i * h, p, j, low, high, True)
            if carry(rates, guards, resets, directions, move, one, own, side, here, endless) == 0:
                return False
            for r in range(states):
                x[r, j] = here[r]
        if (i + 1) % substeps == 0:
            for r in range(states):
                for j in range(lanes):
                    out[(i + 1) // substeps, r, j] = x[r, j]
    return True


def read_only(nodes: FloatArray) -> FloatArray:
    """Return inputs as `Step` has them: kernels are compiled for arrays that are not written to."""
    view = nodes.view()
    view.setflags(write=False)
    return view


def with_kernels(laws: Laws) -> tuple[Any, ...]:
    """Return laws as integrators take them: one by one, with `_move` and `carry`, which no integrator has in itself."""
    one, nodes = np.empty(1), read_only(np.empty((1, 1, 1)))
    step = Step(nodes, 0, 0.0, 0.0, np.empty((1, 1)), 0, one, one, False)
    own = Scratch(np.empty((1, 1)), one, np.empty((1, 1)), one, one, np.empty((1, 1)))
    move = first_class(_move, laws.rates, step, own, one, 0.0, 0.0, one)
    return (*laws, move, first_class(carry, *laws, move, step, own, np.empty((1, 1)), one, one))
