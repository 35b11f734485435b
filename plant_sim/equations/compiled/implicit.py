"""Linearly implicit Euler steps, extrapolated to order 4, for stiff models: one kernel that calls any model's rates.

Each step H is done with 1, 2, 3 and 4 Euler steps h = H/k, (I - h J) dx = h f(t + h, u, x), J by finite differences at
the step's start, and the four results are extrapolated in h. What decays fast decays in the first of them. A step costs
so much that the call of a law by its address does not show, and no integrator is compiled for a model.

References: Deuflhard, SIAM Review 27 (1985) 505; Hairer, Wanner, Solving Ordinary Differential Equations II, IV.9.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_sim.elimination import solve_in_place
from plant_sim.equations.compiled.source import law_source, loaded
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel

ORDER = 4
SHARE = 1e-6
"""Step of a finite difference, as a share of a state's size."""
MOVED_SHARE = 1e-8
"""Least step of a finite difference, as a share of what a state moves in an integration step by its rate alone.

A state that is zero has no size: a step by that alone drowns in the rounding of its rate, its slope is lost, and what
should decay grows (LSODE sets such a floor too: Hindmarsh, ODEPACK, 1983). The share keeps the slope's rounding at 1e-8
of 1/h.
"""


def derive_source(system: System) -> str:
    """Return the source of the law `derive(x, u, t, p, j, rates) -> 0`, which fills `rates` (states,)."""
    head = loaded(system, "derive(x, u, t, p, j, rates)")
    places = ", ".join(f"rates[{k}]" for k in range(len(system.states)))
    return law_source(system, head, f"{places}, = {{rates}},\n    return 0", limited=True)


@kernel
def at_share(nodes: FloatArray, i: int, share: float, u: FloatArray) -> None:
    """Fill `u` (inputs,) at a share of step `i`, on the parabola through its start, middle and end."""
    first, middle, last = (
        (1.0 - share) * (1.0 - 2.0 * share), 4.0 * share * (1.0 - share), share * (2.0 * share - 1.0),
    )  # fmt: skip
    for k in range(u.shape[0]):
        u[k] = first * nodes[0, i, k] + middle * nodes[1, i, k] + last * nodes[2, i, k]


# 8 parameters because a compiled kernel takes its arrays one by one
@kernel
def fill_slopes(  # noqa: PLR0913
    derive: Any, x: FloatArray, u: FloatArray, t: float, h: float, p: FloatArray, j: int, slopes: FloatArray
) -> None:
    """Fill the Jacobian `slopes` (states, states) of the rates of lane `j` at `x` (states,), for a step of `h` [s]."""
    n = x.shape[0]
    base, moved = np.empty(n), np.empty(n)
    derive(x, u, t, p, j, base)
    for c in range(n):
        before = x[c]
        step = max(SHARE * max(abs(before), 1e-12), MOVED_SHARE * abs(h * base[c]))
        x[c] = before + step
        derive(x, u, t, p, j, moved)
        x[c] = before
        for r in range(n):
            slopes[r, c] = (moved[r] - base[r]) / step


# 10 parameters because a compiled kernel takes its arrays one by one
@kernel
def lane_step(  # noqa: PLR0913
    derive: Any, x: FloatArray, nodes: FloatArray, i: int, h: float, t: float, p: FloatArray, j: int,
    begin: float = 0.0, end: float = 1.0,
) -> FloatArray:  # fmt: skip
    """Return the states (states,) of lane `j` at share `end` of step `i` from `x` (states,) at share `begin`.

    The step as a whole has the length `h` and begins at the time `t`.
    """
    ended: FloatArray = lane_table(derive, x, nodes, i, h, t, p, j, begin, end)[0]
    return ended


# 10 parameters because a compiled kernel takes its arrays one by one
@kernel
def lane_table(  # noqa: PLR0913
    derive: Any, x: FloatArray, nodes: FloatArray, i: int, h: float, t: float, p: FloatArray, j: int,
    begin: float, end: float,
) -> FloatArray:  # fmt: skip
    """Return what `lane_step` does of the orders 4, 3, 2 and 1, (4, states); the first two differ by their error."""
    n = x.shape[0]
    slopes, matrix, table = np.empty((n, n)), np.empty((n, n)), np.empty((ORDER, n))
    here, rhs, u = np.empty(n), np.empty(n), np.empty(nodes.shape[2])
    at_share(nodes, i, begin, u)
    fill_slopes(derive, x, u, t + begin * h, (end - begin) * h, p, j, slopes)
    for k in range(1, ORDER + 1):
        own = (end - begin) * h / k
        for r in range(n):
            here[r] = x[r]
        for s in range(1, k + 1):
            at_share(nodes, i, begin + (end - begin) * (s / k), u)
            derive(here, u, t + begin * h + s * own, p, j, rhs)
            for r in range(n):
                rhs[r] *= own
                for c in range(n):
                    matrix[r, c] = (1.0 if r == c else 0.0) - own * slopes[r, c]
            solve_in_place(matrix, rhs)
            for r in range(n):
                here[r] += rhs[r]
        for r in range(n):
            table[k - 1, r] = here[r]
            for m in range(1, k):  # Aitken and Neville
                change = table[k - m, r] - table[k - m - 1, r]
                table[k - m - 1, r] = table[k - m, r] + change / (k / (k - m) - 1.0)
    return table


# 10 parameters because a compiled kernel takes its arrays one by one
@background_kernel
def extrapolate(  # noqa: PLR0913
    derive: Any,
    x: FloatArray,
    nodes: FloatArray,
    h: float,
    substeps: int,
    start_s: float,
    p: FloatArray,
    low: FloatArray,
    high: FloatArray,
    out: FloatArray,
) -> None:
    """March all lanes through a record, as `rk4` of `plant_sim.equations.compiled.explicit` does.

    Args:
        derive: Law of the model by its address.
        x: States (states, lanes) at the start, left at the end [SI].
        nodes: Inputs (3, steps, inputs) [SI].
        h: Step [s].
        substeps: Steps between two samples.
        start_s: Time at the start [s].
        p: Parameters (parameters, lanes) [SI].
        low: Lower limits (states,) [SI].
        high: Upper limits (states,) [SI].
        out: States (samples, states, lanes); row 0 is left to the caller.
    """
    states, lanes = x.shape
    begun = np.empty(states)
    row, until_sample = 1, substeps
    for i in range(nodes.shape[1]):
        for j in range(lanes):
            for r in range(states):
                begun[r] = x[r, j]
            ended = lane_step(derive, begun, nodes, i, h, start_s + i * h, p, j)
            for r in range(states):
                x[r, j] = min(max(ended[r], low[r]), high[r])
        until_sample -= 1
        if until_sample == 0:
            until_sample = substeps
            for r in range(states):
                for j in range(lanes):
                    out[row, r, j] = x[r, j]
            row += 1
