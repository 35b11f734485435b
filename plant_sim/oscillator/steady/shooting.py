"""Periodic motions under a periodic drive, by shooting: the state that one period of the drive leads back to itself.

P(s) is the state after one period from s. Newton's method on F(s) = P(s) - s, with dP/ds by finite differences, costs a
few periods, whatever the quality factor; following the motion in time costs several Q. A step is trusted only while it
makes F four times smaller, and an orbit only if it is stable: otherwise (at a fold of the response) the motion is
followed in time, as the device does, and Newton's method starts again from there. The states are displacement, velocity
and those of the mechanisms. The compiled integrator of the equation is an argument.

Reference: A. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics (1995), 6.2.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import types

from plant_sim.elimination import solve_in_place
from rtctl.border.kernels import called_kernel

DIFFERENCE = 1e-6
"""Step of the finite differences, relative to the size of a state."""
CLOSED = 1e-12
"""Largest |F|, relative to the size of the motion, of an orbit that counts as closed."""
NEARLY = 1e-7
"""Largest step of Newton's method, relative to the size of the motion, after which no further one is needed.

What is left is its square, and DIFFERENCE of it; the course over the period follows the step to first order.
"""
CONTRACTION = 0.5
"""Share of |F| that a trusted step of Newton's method may leave; forces that are not smooth leave a third."""
MOST_STEPS = 16
"""Steps of Newton's method; in its basin the number of digits doubles with each."""
STABLE = 1.0 + 1e-6
"""Largest magnitude of a multiplier (an eigenvalue of dP/ds) of an orbit that a device stays on."""
NEAR = 0.02
"""Difference of two lanes that begin, in parts of the first one, up to which the other may begin on its orbit."""
SQUARINGS = 30
"""Squarings of dP/ds by which its largest multiplier is found.

At a power of 4096 the units of the states still count: a factor of 160 between them is 1.0012, the margin at Q = 2700.
"""


@called_kernel
def fill(state: Any, z: Any, v: Any, own: Any) -> None:
    """Set all lanes to one state."""
    for j in range(z.shape[0]):
        z[j], v[j] = state[0], state[1]
        for s in range(own.shape[0]):
            own[s, j] = state[2 + s]


@called_kernel
def value(z: Any, v: Any, own: Any, s: int, j: int) -> Any:
    """Return state `s` of lane `j`."""
    return z[j] if s == 0 else v[j] if s == 1 else own[s - 2, j]


@called_kernel
def set_sizes(size: Any, state: Any, rate: float) -> None:
    """Set the size of each state of a motion at angular frequency `rate` [1/s]; zeros at rest."""
    size[0] = max(abs(state[0]), abs(state[1]) / rate)
    size[1] = size[0] * rate
    for s in range(2, size.shape[0]):
        size[s] = max(abs(state[s]), size[0])


@called_kernel
def largest_multiplier(m: Any) -> Any:
    """Return the largest magnitude of an eigenvalue of `m`, which is used up: |m^N|^(1/N) for a large N."""
    n, total, power = m.shape[0], 0.0, 1.0
    product = np.empty((n, n))
    for _ in range(SQUARINGS):
        norm = 0.0
        for i in range(n):
            for c in range(n):
                norm = max(norm, abs(m[i, c]))
        if not norm > 0.0:
            return 0.0
        total += math.log(norm) / power
        for i in range(n):
            for c in range(n):
                product[i, c] = 0.0
                for k in range(n):
                    product[i, c] += (m[i, k] / norm) * (m[k, c] / norm)
        for i in range(n):
            for c in range(n):
                m[i, c] = product[i, c]
        power *= 2.0
    return math.exp(total)


@called_kernel
def set_slopes(multipliers: Any, slopes: Any, z: Any, v: Any, own: Any, size: Any) -> None:
    """Set dP/ds, scaled by the sizes, and dF/ds from lanes that began a small step of each state apart.

    A state that never moves has a row of zeros in dF/ds; its 1 there keeps it where it is.
    """
    n = size.shape[0]
    for s in range(n):
        most = 0.0
        for c in range(n):
            moved = value(z, v, own, s, 1 + c) - value(z, v, own, s, 0)
            multipliers[s, c] = moved / (DIFFERENCE * size[s])
            slopes[s, c] = multipliers[s, c] - (1.0 if s == c else 0.0)
            most = max(most, abs(slopes[s, c]))
        if most == 0.0:
            slopes[s, s] = 1.0


@called_kernel
def spread(z: Any, v: Any, own: Any, size: Any) -> None:
    """Move each lane but the first by a small step of one state."""
    z[1] += DIFFERENCE * size[0]
    v[2] += DIFFERENCE * size[1]
    for s in range(2, size.shape[0]):
        own[s - 2, 1 + s] += DIFFERENCE * size[s]


@called_kernel
def near(state: Any, other: Any, rate: float) -> bool:
    """Return whether two states of motions at angular frequency `rate` [1/s] differ little."""
    most = NEAR * max(abs(other[0]), abs(other[1]) / rate)
    return bool(abs(state[0] - other[0]) <= most and abs(state[1] - other[1]) <= most * rate)


class Lanes(NamedTuple):
    """Arrays of motions that are followed together: by which one orbit is found, one a state more than the states."""

    coefficients: Any
    """Coefficients (rows, lanes) of the equation, the same in each lane."""
    z: Any
    """Displacement (lanes,)."""
    v: Any
    """Velocity (lanes,)."""
    own: Any
    """States of the mechanisms (states - 2, lanes)."""
    out_z: Any
    """Displacement (instants, lanes) over the period."""
    out_v: Any
    """Velocity (instants, lanes) over the period."""
    marched: Any
    """Periods (1,) that have been integrated, of all lanes together."""


@called_kernel
def lanes_for(states: int, lanes: int, rows: int, instants: int) -> Any:
    """Return arrays for `lanes` motions with `rows` coefficients, of which `instants` are kept."""
    return Lanes(
        np.empty((rows, lanes)),
        np.empty(lanes),
        np.empty(lanes),
        np.empty((states - 2, lanes)),
        np.empty((instants, lanes)),
        np.empty((instants, lanes)),
        np.zeros(1),
    )


@called_kernel
def set_coefficients(coefficients: Any, p: Any, lane: int) -> None:
    """Set all lanes to the coefficients `p` (rows, lanes) of one lane."""
    for k in range(p.shape[0]):
        for j in range(coefficients.shape[1]):
            coefficients[k, j] = p[k, lane]


@called_kernel
def follow(march: Any, state: Any, nodes: Any, h: float, periods: int, alone: Any) -> None:
    """Move `state` (states,) on by periods of the drive."""
    fill(state, alone.z, alone.v, alone.own)
    for _ in range(periods):
        march(
            alone.z,
            alone.v,
            alone.own,
            nodes,
            h,
            nodes.shape[0],
            alone.coefficients,
            alone.out_z,
            alone.out_v,
        )
    alone.marched[0] += periods
    for s in range(state.shape[0]):
        state[s] = value(alone.z, alone.v, alone.own, s, 0)


@called_kernel
def move_course(out_z: Any, left: Any) -> None:
    """Move the first course by a step of -`left` (states,) along those that began a small step of each state apart."""
    for i in range(out_z.shape[0]):
        here = out_z[i, 0]
        for s in range(left.shape[0]):
            out_z[i, 0] -= left[s] / DIFFERENCE * (out_z[i, 1 + s] - here)


@called_kernel
def newton(march: Any, state: Any, nodes: Any, h: float, lanes: Any) -> bool:
    """Move `state` (states,) to a stable closed orbit by trusted steps, and return whether that went well.

    The displacement over the orbit is then in the first lane of `lanes.out_z`.

    Args:
        march: integrator of the equation.
        state: where to begin, moved.
        nodes: drive (steps, 3) over one period.
        h: step [s].
        lanes: `Lanes` to calculate in.
    """
    z, v, own = lanes.z, lanes.v, lanes.own
    n, rate = state.shape[0], 2.0 * math.pi / (h * nodes.shape[0])
    size, left, multipliers, slopes = np.empty(n), np.empty(n), np.empty((n, n)), np.empty((n, n))
    set_sizes(size, state, rate)
    if not size[0] > 0.0:  # at rest: the size is that of the first period
        fill(state, z, v, own)
        march(z, v, own, nodes, h, 1, lanes.coefficients, lanes.out_z, lanes.out_v)
        lanes.marched[0] += n + 1
        for s in range(n):
            left[s] = value(z, v, own, s, 0)
        set_sizes(size, left, rate)
    if not size[0] > 0.0:
        return True  # nothing drives it
    before = np.inf
    for _ in range(MOST_STEPS):
        fill(state, z, v, own)
        spread(z, v, own, size)
        march(z, v, own, nodes, h, 1, lanes.coefficients, lanes.out_z, lanes.out_v)
        lanes.marched[0] += n + 1
        set_slopes(multipliers, slopes, z, v, own, size)
        distance = 0.0
        for s in range(n):
            left[s] = (value(z, v, own, s, 0) - state[s]) / size[s]
            distance = max(distance, abs(left[s])) if math.isfinite(left[s]) else np.inf
        if not distance <= max(CONTRACTION * before, CLOSED):
            return False
        solve_in_place(slopes, left)
        change = 0.0
        for s in range(n):
            state[s] -= left[s] * size[s]
            change = max(change, abs(left[s]))
        if distance <= CLOSED or change <= NEARLY:
            move_course(lanes.out_z, left)
            return bool(largest_multiplier(multipliers) <= STABLE)
        before = distance
        set_sizes(size, state, rate)
    return False


@called_kernel
def close_orbit(march: Any, begin: Any, state: Any, nodes: Any, h: float, lanes: Any) -> bool:
    """Put the orbit that Newton's method finds from `begin` (states,) into `state`, which else stays."""
    found = begin.copy()
    if not newton(march, found, nodes, h, lanes):
        return False
    for s in range(state.shape[0]):
        state[s] = found[s]
    return True


# 9 parameters because a kernel takes its arrays one by one
def shoot(  # noqa: PLR0913
    march: Any,
    states: Any,
    guesses: Any,
    p: Any,
    nodes: Any,
    h: float,
    settling: int,
    attempts: int,
    out_z: Any,
) -> float:
    """Put the orbit on which each lane settles in place of its state, and the displacement over it in `out_z`.

    Return the periods that were integrated, of all lanes together.

    A motion that does not repeat with the drive is what it is after the last attempt; one that runs away is not finite.
    A lane that finds no orbit from its state tries, before it follows the motion in time, that of the first lane if
    both begin near each other, as the lanes by which a slope is found do, and then its guess.

    Args:
        march: integrator of the equation.
        states: (lanes, states) from which the motions settle.
        guesses: (lanes, states) near which their orbits may be; NaN: not known.
        p: coefficients (rows, lanes) of the equation.
        nodes: drive (steps, 3) over one period.
        h: step [s].
        settling: periods that a motion is followed before Newton's method is tried again.
        attempts: times that a motion is followed before it is taken as it is.
        out_z: displacement (steps, lanes), out.
    """
    lanes, n, steps = states.shape[0], states.shape[1], nodes.shape[0]
    rate = 2.0 * math.pi / (h * steps)
    apart, alone = lanes_for(n, n + 1, p.shape[0], steps + 1), lanes_for(n, 1, p.shape[0], 2)
    first_began, first_closed = states[0].copy(), False
    for lane in range(lanes):
        set_coefficients(apart.coefficients, p, lane)
        set_coefficients(alone.coefficients, p, lane)
        closed = False
        for attempt in range(attempts):
            if not math.isfinite(states[lane, 0]):
                break
            beside = attempt == 0 and first_closed and near(states[lane], first_began, rate)
            closed = close_orbit(march, states[lane], states[lane], nodes, h, apart)
            closed = closed or (beside and close_orbit(march, states[0], states[lane], nodes, h, apart))
            if not closed and attempt == 0 and math.isfinite(guesses[lane, 0]):
                closed = close_orbit(march, guesses[lane], states[lane], nodes, h, apart)
            if closed:
                first_closed = first_closed or lane == 0
                break
            follow(march, states[lane], nodes, h, settling, alone)
        if not closed:
            fill(states[lane], apart.z, apart.v, apart.own)
            march(apart.z, apart.v, apart.own, nodes, h, 1, apart.coefficients, apart.out_z, apart.out_v)
            apart.marched[0] += n + 1
        for i in range(steps):
            out_z[i, lane] = apart.out_z[i, 0]
    return float(apart.marched[0] + alone.marched[0])


_LINE, _TABLE, _NUMBER = types.float64[::1], types.float64[:, ::1], types.float64
_MARCH = types.void(_LINE, _LINE, _TABLE, _TABLE, _NUMBER, types.int64, _TABLE, _TABLE, _TABLE)


class March(types.WrapperAddressProtocol):
    """A compiled integrator as an argument of `shoot`; its address is looked up once, not at each of many calls."""

    def __init__(self, compiled: Any) -> None:
        """Take the machine code of a compiled integrator."""
        found = compiled.get_compile_result(_MARCH)
        self._kept = compiled
        self._address = found.library.get_pointer_to_function(found.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        """Return the address of the machine code."""
        return int(self._address)

    def signature(self) -> Any:
        """Return the types of arguments and result."""
        return _MARCH


def as_argument(compiled: Any) -> Any:
    """Return an integrator as `shoot` takes it."""
    return March(compiled) if isinstance(compiled, numba.core.dispatcher.Dispatcher) else compiled


@lru_cache(maxsize=1)
def shooting() -> Any:
    """Return `shoot`, compiled once for the integrators of all equations."""
    compiled: Any = called_kernel(shoot)
    if not isinstance(compiled, numba.core.dispatcher.Dispatcher):  # NUMBA_DISABLE_JIT=1
        return compiled
    shape = (
        types.FunctionType(_MARCH), _TABLE, _TABLE, _TABLE, _TABLE, _NUMBER, types.int64, types.int64, _TABLE,
    )  # fmt: skip
    compiled.compile(shape)
    return compiled.get_overload(shape)
