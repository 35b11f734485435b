"""Inverse of a rising Preisach model: the v that gives y on its branch, bracketed, then exact in a cell.

Going up, older maxima s_m are passed for as long as y exceeds the output they had; that leaves the branch
(its base extremum and H there) and a bracket of v. Nodes of the grid halve the bracket to one cell, where y
is a quadratic. Asking does not touch the state: `preisach_step` with the answer does.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.preisach.everett import (
    cell_above,
    cell_below,
    everett,
    everett_falling_slope,
    everett_rising_slope,
)
from rtctl.hysteresis.preisach.model import (
    PreisachModel,
    PreisachParams,
    output_at,
    preisach_slope,
    preisach_step,
)
from rtctl.hysteresis.status import IN_GAP, NOT_FINITE, OK, OUT_OF_RANGE, SATURATED, BranchPoint
from rtctl.hysteresis.tables import inputs


def check_invertible(model: PreisachModel) -> None:
    """Raise ValueError unless y never falls with v: sign = 1, c1 + 2 c2 v >= 0 at both ends of the grid."""
    slopes = model.c1 + 2.0 * model.c2 * model.grid[[0, -1]]
    if model.sign != 1.0 or (slopes < 0.0).any():
        raise ValueError(
            f"only a rising Preisach model has this inverse: sign = {model.sign:g}, "
            f"memoryless slopes {slopes[0]:g} and {slopes[1]:g} at the ends of the grid"
        )


@kernel
def preisach_invert(state: FloatArray, y: float, params: PreisachParams) -> BranchPoint:
    """Return the v that gives y from `state`, which is left alone; the model must pass `check_invertible`.

    A y beyond the grid's outputs is answered with the end of the grid, flagged SATURATED and OUT_OF_RANGE;
    where y stands still with v (slope 0), the v nearest to the last one, flagged IN_GAP; a y that is not finite
    with the last v.
    """
    top = int(state[0])
    now = output_at(state, top, params)
    if not math.isfinite(y) or y == now:
        slope = preisach_slope(state, params)
        status = OK if y == now else NOT_FINITE
        return BranchPoint(state[1 + top], slope, status if slope > 0.0 else status | IN_GAP)
    rising = y > now
    m = top if rising == (top % 2 == 1) else top + 1  # the segment s_{m-1} -> v that the answer lies on
    near = state[1 + top]
    oldest = 3 if rising else 2
    while m >= oldest:
        reached = output_at(state, m - 2, params)
        if (y < reached) if rising else (y > reached):
            break
        near = state[m - 1]
        m -= 2
    beyond = False
    if m == 0:
        beyond, v = _exceeds(output_at(state, 0, params), y), params.grid[0]
    else:
        far = params.grid[-1] if m == 1 else state[m - 1]
        low, high = (near, far) if rising else (far, near)
        v, beyond = _on_branch(y, low, high, state[m], _mass_at(state, m - 1), params)
    return _answer(v, state[max(m, 1)], rising, beyond, params)


@kernel
def _mass_at(state: FloatArray, m: int) -> float:
    """Return H_m, the mass that was on at the extremum s_m."""
    return float(state[1 + state.size // 2 + m])


@kernel
def _exceeds(y: float, limit: float) -> bool:
    """Return whether y > limit by more than the rounding of sums of that size."""
    return y > limit + 1e-14 * (1.0 + abs(limit))


@kernel
def _on_branch(
    y: float, low: float, high: float, base: float, mass: float, params: PreisachParams
) -> tuple[float, bool]:
    """Find v in [low, high] on the branch from `base`, where `mass` was on; True where y lies beyond."""
    grid = params.grid
    y_low = branch_output(low, base, mass, params)
    y_high = branch_output(high, base, mass, params)
    rising = base <= low
    if y >= y_high:
        return high, rising and _exceeds(y, y_high)
    first, last = cell_above(grid, low), cell_below(grid, high)
    while first < last:
        middle = (first + last + 1) // 2
        y_middle = branch_output(grid[middle], base, mass, params)
        if y_middle < y or (y_middle == y and not rising):
            low, y_low, first = grid[middle], y_middle, middle
        else:
            high, y_high, last = grid[middle], y_middle, middle - 1
    return low + _quadratic_step(y - y_low, y_high - y_low, high - low, params.c2), False


@kernel
def _quadratic_step(gain: float, total: float, width: float, curvature: float) -> float:
    """Return t in [0, width] with m t + curvature t^2 = gain, where m follows from the gain `total` at t = width."""
    if not (gain > 0.0 and total > 0.0):
        return 0.0
    m = total / width - curvature * width
    t = 2.0 * gain / (m + math.sqrt(max(m * m + 4.0 * curvature * gain, 0.0)))
    return min(max(t, 0.0), width)


@kernel
def branch_output(v: float, base: float, mass: float, params: PreisachParams) -> float:
    """Return y at v on the branch from the extremum `base`, where the mass `mass` was on; rising for v >= base."""
    if v >= base:
        mass += everett(v, base, params.grid, params.nodes)
    else:
        mass -= everett(base, v, params.grid, params.nodes)
    return params.c + params.sign * mass + v * (params.c1 + params.c2 * v)


@kernel
def _answer(v: float, base: float, rising: bool, beyond: bool, params: PreisachParams) -> BranchPoint:
    if rising:
        slope = everett_rising_slope(v, base, params.grid, params.nodes)
    else:
        slope = everett_falling_slope(base, v, params.grid, params.nodes)
    slope += params.c1 + 2.0 * params.c2 * v
    status = SATURATED | OUT_OF_RANGE if beyond else OK
    return BranchPoint(v, slope, status if slope > 0.0 else status | IN_GAP)


@kernel
def preisach_inverse_step(state: FloatArray, y: float, params: PreisachParams) -> BranchPoint:
    """Apply `preisach_invert`, then advance `state` to the answer in place."""
    point = preisach_invert(state, y, params)
    preisach_step(state, point.v, params)
    return point


@kernel
def preisach_inverse_run(
    state: FloatArray, y: FloatArray, params: PreisachParams
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return v, slope and status, each (samples,), for the outputs y (samples,); advance `state` in place."""
    v, slope, status = np.empty_like(y), np.empty_like(y), np.zeros(y.size, np.int64)
    for k in range(y.size):
        point = preisach_inverse_step(state, y[k], params)
        v[k], slope[k], status[k] = point.v, point.slope, point.status
    return v, slope, status


def invert_preisach(
    model: PreisachModel, y: FloatArray, state: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return v, slope, status (samples,) for y (samples,), from a copy of `state` or from a full cooling."""
    check_invertible(model)
    start = model.initial_state(model.grid[0]) if state is None else state.copy()
    return preisach_inverse_run(start, inputs(y), model.params)
