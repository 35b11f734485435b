"""The implicit steps of `plant_sim.equations.compiled.implicit` at lengths that follow the motion, lane by lane.

A motion that rests for seconds and jumps within microseconds (a relaxation oscillation) needs the steps of its jumps
only there. The error of a step is the difference of the extrapolation's last two orders; the next step is as long as
keeps it at a tolerance. Lanes have steps of their own: their jumps are not at the same time.

Reference: Hairer, Wanner, Solving Ordinary Differential Equations II, IV.9; step sizes as ibid. I, II.4.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_sim.equations.compiled.implicit import lane_table
from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import background_kernel, kernel

SAFETY, LEAST_CHANGE, MOST_CHANGE = 0.8, 0.1, 4.0
"""Of the length that would just keep the tolerance, and how much one step may be shorter or longer than the last."""
ERROR_ORDER = 4.0
"""Power of its length with which a step's error grows."""
SHORTEST = 1e-13
"""Step, as a share of the time between two instants, below which the motion cannot be followed."""
SMALLEST, NO_ERROR = 1e-300, 1e-10
DONE, TOO_MANY, TOO_SHORT = 0, 1, 2


@kernel
def _error(table: FloatArray, size: FloatArray, tolerance: float) -> float:
    """Return the largest error of a step over what is tolerated; infinite where the step has left all bounds."""
    error = 0.0
    for r in range(size.shape[0]):
        off = abs(table[0, r] - table[1, r])
        if not off < np.inf:
            return np.inf
        if off > 0.0:
            error = max(error, off / (tolerance * max(size[r], abs(table[0, r]), SMALLEST)))
    return error


@kernel
def _change(error: float) -> float:
    """Return by how much the next step is longer, after one with an `error` over what is tolerated."""
    if error == np.inf:
        return LEAST_CHANGE
    change: float = SAFETY * max(error, NO_ERROR) ** (-1.0 / ERROR_ORDER)
    return min(max(change, LEAST_CHANGE), MOST_CHANGE)


# 14 parameters because a compiled kernel takes its arrays one by one
@kernel
def _across(  # noqa: PLR0913
    derive: Any, here: FloatArray, size: FloatArray, nodes: FloatArray, i: int, h: float, t: float, p: FloatArray,
    j: int, low: FloatArray, high: FloatArray, tolerance: float, share: float, most: int,
) -> tuple[float, int]:  # fmt: skip
    """March lane `j` over step `i`, whose first piece is a `share` of it; `here` and `size` (states,) go along.

    Returns:
        The share of the next piece, below `SHORTEST` where none is short enough, and the pieces, more than `most` where
        these did not suffice.
    """
    begin, taken = 0.0, 0
    while begin < 1.0 and taken <= most and share >= SHORTEST:
        end = 1.0 if begin + 1.1 * share > 1.0 else begin + share
        table = lane_table(derive, here, nodes, i, h, t, p, j, begin, end)
        error = _error(table, size, tolerance)
        length = min((end - begin) * _change(error), 1.0)
        taken += 1
        if error > 1.0:
            share = length
            continue
        for r in range(here.shape[0]):
            here[r] = min(max(table[0, r], low[r]), high[r])
            size[r] = max(size[r], abs(here[r]))
        share = max(share, length) if end == 1.0 else length
        begin = end
    return share, taken


# 13 parameters because a compiled kernel takes its arrays one by one
@background_kernel
def adapt(  # noqa: PLR0913
    derive: Any,
    x: FloatArray,
    nodes: FloatArray,
    h: float,
    substeps: int,
    start_s: float,
    p: FloatArray,
    low: FloatArray,
    high: FloatArray,
    tolerance: float,
    most: int,
    out: FloatArray,
    ended: FloatArray,
) -> IntArray:
    """March all lanes through a record as `extrapolate` does, each step of `h` in pieces that keep the tolerance.

    Args:
        derive: Law of the model by its address.
        x: States (states, lanes) at the start, left at the end [SI].
        nodes: Inputs (3, steps, inputs) [SI].
        h: Time [s] between two instants at which the inputs are known.
        substeps: Such times between two samples.
        start_s: Time at the start [s].
        p: Parameters (parameters, lanes) [SI].
        low: Lower limits (states,) [SI].
        high: Upper limits (states,) [SI].
        tolerance: Error of a step, as a share of the largest value that a state had so far.
        most: Steps of a lane at most.
        out: States (samples, states, lanes); row 0 is left to the caller.
        ended: Time (1,) [s] at the start of the step over which a lane could not go on; written where one could not.

    Returns:
        How it ended, `DONE`, `TOO_MANY` or `TOO_SHORT`, and the steps of all lanes (2,).
    """
    states, lanes = x.shape
    here, size = np.empty(states), np.empty(states)
    steps = 0
    for j in range(lanes):
        for r in range(states):
            here[r] = x[r, j]
            size[r] = abs(here[r])
        share, left = 1.0, most
        for i in range(nodes.shape[1]):
            t = start_s + i * h
            share, taken = _across(
                derive, here, size, nodes, i, h, t, p, j, low, high, tolerance, share, left
            )
            steps += taken
            left -= taken
            if left < 0 or share < SHORTEST:
                ended[0] = t
                return np.array([TOO_SHORT if share < SHORTEST else TOO_MANY, steps])
            if (i + 1) % substeps == 0:
                for r in range(states):
                    out[(i + 1) // substeps, r, j] = here[r]
        for r in range(states):
            x[r, j] = here[r]
    return np.array([DONE, steps])
