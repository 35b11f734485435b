"""States of mechanisms (a relaxing spring, a hysteretic force), as the integrator holds them.

A memory law is `(z, v, u, t, w, p, row, j) -> (acceleration, dw/dt)`: `w` the tuple of its states, `p[row + i, j]` its
own parameter i in lane j. Of a damper c(z) z' that acts at some places alone a law leaves the force out: beside it
stands `(z, p, row, j) -> (impulse, c)`, where the impulse is the integral of c over the place
(`plant_sim.oscillator.integration.rk4`). States are tuples, which the compiler keeps in registers; their number is a
constant of the compiled kernel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numba.cpython.unsafe import tuple as numba_tuple

from plant_sim.oscillator.equation.binding import bind, law
from plant_sim.oscillator.equation.terms import nominal

tuple_setitem: Any = numba_tuple.tuple_setitem  # an intrinsic: mypy sees its wrong side


@law
def loaded(zeros: Any, w: Any, j: int) -> Any:
    """Return the states of lane `j` of `w` (states, lanes) as a tuple as long as `zeros`."""
    result = zeros
    for s in range(len(zeros)):
        result = tuple_setitem(result, s, w[s, j])
    return result


@law
def moved(w: Any, h: float, d: Any) -> Any:
    """Return `w + h d`, element by element."""
    result = w
    for s in range(len(w)):
        result = tuple_setitem(result, s, w[s] + h * d[s])
    return result


@law
def store(w: Any, j: int, values: Any) -> None:
    """Set lane `j` of `w` (states, lanes) to `values`."""
    for s in range(len(values)):
        w[s, j] = values[s]


base: Any = nominal  # replaced by `bind`, as all of these
added: Any = None
ROW = STATES_BEFORE = 0


def with_memory(z: float, v: float, u: float, t: float, w: Any, p: Any, j: int) -> Any:
    """Return z'' and the states' rates of the memoryless law `base` and the memory law `added`."""
    force, rates = added(z, v, u, t, w, p, ROW, j)
    return base(z, v, u, t, p, j) + force, rates


def with_more_memory(z: float, v: float, u: float, t: float, w: Any, p: Any, j: int) -> Any:
    """Return the same if `base` has states already, the first `STATES_BEFORE`."""
    before, rates_before = base(z, v, u, t, w[:STATES_BEFORE], p, j)
    force, rates = added(z, v, u, t, w[STATES_BEFORE:], p, ROW, j)
    return before + force, rates_before + rates


def combined(memoryless: Any, laws: Sequence[tuple[Any, int, int]]) -> Any:
    """Return one law of a memoryless one and memory laws, each with its first row in `p` and its number of states."""
    total = memoryless
    states = 0
    for law_, row, count in laws:
        template = with_more_memory if states else with_memory
        total = bind(template, inline=True, base=total, added=law_, ROW=row, STATES_BEFORE=states)
        states += count
    return total


PART = 0


def with_damper(z: float, p: Any, j: int) -> Any:
    """Return the impulse (`PART` 0) or the damping (1) of the damping law `added`."""
    return added(z, p, ROW, j)[PART]


def with_more_dampers(z: float, p: Any, j: int) -> Any:
    """Return that and `base`."""
    return base(z, p, j) + added(z, p, ROW, j)[PART]


def combined_dampers(laws: Sequence[tuple[Any, int]], part: int) -> Any:
    """Return the sum of impulses (`part` 0) or dampings (1) of damping laws, each with its first row; None: no law."""
    total: Any = None
    for law_, row in laws:
        if total is None:
            total = bind(with_damper, inline=True, added=law_, ROW=row, PART=part)
        else:
            total = bind(with_more_dampers, inline=True, base=total, added=law_, ROW=row, PART=part)
    return total
