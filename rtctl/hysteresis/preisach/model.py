"""Preisach model by its Everett function: y = c + sign H + c1 v + c2 v^2, O(1) a sample on average.

The memory is the stack of alternating extrema s_0 = x_0 < s_2 < ... < s_k = v < ... < s_3 < s_1 that the
input has left: s_m of odd m are maxima, of even m minima. H_m = H_{m-1} + E(s_m, s_{m-1}) going up and
H_{m-1} - E(s_{m-1}, s_m) going down, from H_0 = 0 with all relays off. An input that passes an older
extremum wipes the pair inside it, so each sample computes one increment.

State order: k, then s_0 ... s_255, then H_0 ... H_255. When the stack is full, the innermost loop is
forgotten.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel, uncounted
from rtctl.hysteresis.preisach.everett import (
    everett,
    everett_falling_slope,
    everett_rising_slope,
    everett_table,
    rising_grid,
)
from rtctl.hysteresis.status import NOT_FINITE, OK, OUT_OF_RANGE
from rtctl.hysteresis.tables import Table, inputs, model_of, own_array, own_floats, table_of

MAX_EXTREMA = 256


class PreisachParams(NamedTuple):
    """Parameters: grid (n + 1,) [v unit]; nodes (n + 1, n + 1), E at the nodes [y unit]; sign +-1; c, c1, c2."""

    grid: FloatArray
    nodes: FloatArray
    sign: float
    c: float
    c1: float
    c2: float


class PreisachStep(NamedTuple):
    """Output y [y unit]; status: OUT_OF_RANGE if the input was clipped to the grid, NOT_FINITE if it was held."""

    y: float
    status: int


@kernel
def uncounted_params(params: PreisachParams) -> PreisachParams:
    """Return the parameters without reference counting; see `uncounted`."""
    return PreisachParams(
        uncounted(params.grid), uncounted(params.nodes), params.sign, params.c, params.c1, params.c2
    )


@kernel
def move_input(state: FloatArray, v: float) -> int:
    """Push the input v, which lies within the grid, on the stack and wipe what it passes; return k, the top."""
    top = int(state[0])
    last = state[1 + top]
    if v == last:
        return top
    rising = v > last
    if rising != (top % 2 == 1):
        if top == state.size // 2 - 1:
            top -= 2
        top += 1
    if rising:
        while top >= 3 and v >= state[top - 1]:
            top -= 2
    else:
        while top >= 2 and v <= state[top - 1]:
            top -= 2
    state[0] = top
    state[1 + top] = v
    return top


@kernel
def output_at(state: FloatArray, m: int, params: PreisachParams) -> float:
    """Return the y [y unit] that the model gave at the extremum s_m; m = k is the present one."""
    v = float(state[1 + m])
    return params.c + params.sign * float(state[1 + state.size // 2 + m]) + v * (params.c1 + params.c2 * v)


@kernel
def preisach_step(state: FloatArray, v: float, params: PreisachParams) -> PreisachStep:
    """Return y after the input v; advance `state` in place."""
    if not math.isfinite(v):
        return PreisachStep(output_at(state, int(state[0]), params), NOT_FINITE)
    inside = min(max(v, params.grid[0]), params.grid[-1])
    top = move_input(state, inside)
    levels = 1 + state.size // 2
    if top == 0:
        state[levels] = 0.0
    elif top % 2 == 1:
        gained = everett(inside, state[top], params.grid, params.nodes)
        state[levels + top] = state[levels + top - 1] + gained
    else:
        lost = everett(state[top], inside, params.grid, params.nodes)
        state[levels + top] = state[levels + top - 1] - lost
    return PreisachStep(output_at(state, top, params), OK if inside == v else OUT_OF_RANGE)


@kernel
def preisach_run(state: FloatArray, v: FloatArray, params: PreisachParams) -> FloatArray:
    """Return y (samples,) for the inputs v (samples,); advance `state` in place."""
    y = np.empty_like(v)
    for k in range(v.size):
        y[k] = preisach_step(state, v[k], params).y
    return y


@kernel
def preisach_slope(state: FloatArray, params: PreisachParams) -> float:
    """Return dy/dv if the input goes on as it last moved; at negative saturation, as it rises."""
    top = int(state[0])
    v = float(state[1 + top])
    if top % 2 == 1:
        slope = everett_rising_slope(v, state[top], params.grid, params.nodes)
    elif top > 0:
        slope = everett_falling_slope(state[top], v, params.grid, params.nodes)
    else:
        slope = everett_rising_slope(v, v, params.grid, params.nodes)
    return params.sign * slope + params.c1 + 2.0 * params.c2 * v


def cooled_stack(grid: FloatArray) -> FloatArray:
    """Return the state with all relays off: one extremum, at the lower end of the grid."""
    state = np.zeros(1 + 2 * MAX_EXTREMA)
    state[1] = grid[0]
    return state


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PreisachModel:
    """Nodes grid (n + 1,) [v unit]; masses mu (n (n + 1) / 2,) >= 0 [y unit] in the order of `cell_index`.

    c [y unit], c1 [y/v], c2 [y/v^2] of any sign; sign = -1 where y falls as the relays switch on. Inputs
    beyond the grid are clipped to it. Raises ValueError for a grid that does not rise or a negative mass.
    """

    grid: FloatArray
    mu: FloatArray
    c: float
    c1: float = 0.0
    c2: float = 0.0
    sign: float = 1.0
    nodes: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        own_floats(self, "c", "c1", "c2", "sign")
        n = rising_grid(own_array(self, "grid")).size - 1
        if (own_array(self, "mu", n * (n + 1) // 2) < 0.0).any():
            raise ValueError(f"masses mu must be >= 0, got {self.mu.min():g}")
        if self.sign not in (-1.0, 1.0):
            raise ValueError(f"sign must be 1 or -1, got {self.sign:g}")
        object.__setattr__(self, "nodes", everett_table(self.mu, n))

    @property
    def params(self) -> PreisachParams:
        """Return the parameters of the kernels."""
        return PreisachParams(self.grid, self.nodes, self.sign, self.c, self.c1, self.c2)

    def initial_state(self, v0: float) -> FloatArray:
        """Return the stack after a full cooling, then up to v0."""
        state = cooled_stack(self.grid)
        preisach_step(state, float(v0), self.params)
        return state

    def simulate(self, v: FloatArray, state: FloatArray | None = None) -> FloatArray:
        """Return y (samples,) for v (samples,), from a copy of `state` or from a full cooling."""
        v = inputs(v)
        if not v.size:
            return v
        return preisach_run(self.initial_state(v[0]) if state is None else state.copy(), v, self.params)

    def to_table(self) -> Table:
        """Return plain floats and lists, with `kind = "preisach"`."""
        return table_of(self, "preisach")

    @classmethod
    def from_table(cls, table: Table) -> PreisachModel:
        """Return the model of a table. Raises InputError that names the key."""
        return model_of(cls, "preisach", table)
