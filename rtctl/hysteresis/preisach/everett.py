"""Everett function of a Preisach measure on a non-uniform grid: E(alpha, beta), alpha > beta, and its basis.

E is the mass of the relays that switch up below alpha and down above beta: what the output gains when the
input rises from beta to alpha. Grid nodes x_0 < ... < x_n serve both axes; cell (i, j), i >= j, holds the
mass mu[i (i + 1) / 2 + j] of relays with up-threshold in [x_i, x_{i+1}] and down-threshold in [x_j,
x_{j+1}]. A cell's share at (alpha, beta) is e_ij = fa_i fb_j for i > j and max(0, fa_i + fb_i - 1) for i =
j, with fa_i = clip((alpha - x_i) / h_i, 0, 1), fb_j = clip((x_{j+1} - beta) / h_j, 0, 1): bilinear between
nodes; a cell of the diagonal holds relays of no width, which is its reversible part.

Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1 (Everett); notes on O(1) evaluation in `preisach`.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel


def rising_grid(nodes: FloatArray) -> FloatArray:
    """Return `nodes` (n + 1,) as the kernels take them.

    Raises:
        ValueError: There are fewer than two nodes, or they do not rise.
    """
    grid = np.ascontiguousarray(nodes, dtype=np.float64)
    if grid.size < 2 or not (np.diff(grid) > 0.0).all():
        raise ValueError(f"grid needs two nodes or more that rise strictly, got {grid.tolist()}")
    return grid


def cell_index(i: int, j: int) -> int:
    """Return the index in mu of cell (i, j), i >= j."""
    return i * (i + 1) // 2 + j


def everett_table(mu: FloatArray, n: int) -> FloatArray:
    """Return N[a, b] = E(x_a, x_b) = sum of mu over i < a and j >= b, shape (n + 1, n + 1); 0 for a <= b."""
    mass = np.zeros((n, n))
    mass[np.tril_indices(n)] = mu
    nodes = np.zeros((n + 1, n + 1))
    nodes[1:, :-1] = np.cumsum(np.cumsum(mass, axis=0)[:, ::-1], axis=1)[:, ::-1]
    return nodes


@kernel
def cell_above(grid: FloatArray, x: float) -> int:
    """Return the cell with grid[i] <= x < grid[i + 1], the last one at the upper end."""
    low, high = 0, grid.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if grid[middle] <= x:
            low = middle
        else:
            high = middle
    return low


@kernel
def cell_below(grid: FloatArray, x: float) -> int:
    """Return the cell with grid[j] < x <= grid[j + 1], the first one at the lower end."""
    low, high = 0, grid.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if grid[middle] < x:
            low = middle
        else:
            high = middle
    return low


@kernel
def everett(alpha: float, beta: float, grid: FloatArray, nodes: FloatArray) -> float:
    """Return E(alpha, beta) for beta <= alpha within the grid."""
    i, j = cell_above(grid, alpha), cell_below(grid, beta)
    if j > i:
        return 0.0
    fa = (alpha - grid[i]) / (grid[i + 1] - grid[i])
    fb = (grid[j + 1] - beta) / (grid[j + 1] - grid[j])
    if i == j:
        inner, outer = 0.0, nodes[i + 1, j]
        fa = max(0.0, fa + fb - 1.0)
    else:
        inner = nodes[i, j + 1] + fb * (nodes[i, j] - nodes[i, j + 1])
        outer = nodes[i + 1, j + 1] + fb * (nodes[i + 1, j] - nodes[i + 1, j + 1])
    return float(inner + fa * (outer - inner))


@kernel
def everett_rising_slope(alpha: float, beta: float, grid: FloatArray, nodes: FloatArray) -> float:
    """Return dE / d alpha just above alpha (just below at the upper end): the slope of a rising branch from beta."""
    i, j = cell_above(grid, alpha), cell_below(grid, beta)
    h = grid[i + 1] - grid[i]
    if j >= i:
        return float(nodes[i + 1, i] / h)
    fb = (grid[j + 1] - beta) / (grid[j + 1] - grid[j])
    right = nodes[i + 1, j + 1] - nodes[i, j + 1]
    left = nodes[i + 1, j] - nodes[i, j]
    return float((right + fb * (left - right)) / h)


@kernel
def everett_falling_slope(alpha: float, beta: float, grid: FloatArray, nodes: FloatArray) -> float:
    """Return -dE / d beta just below beta (above, at the lower end): the slope of a falling branch from alpha."""
    i, j = cell_above(grid, alpha), cell_below(grid, beta)
    h = grid[j + 1] - grid[j]
    if j >= i:
        return float(nodes[j + 1, j] / h)
    fa = (alpha - grid[i]) / (grid[i + 1] - grid[i])
    below = nodes[i, j] - nodes[i, j + 1]
    above = nodes[i + 1, j] - nodes[i + 1, j + 1]
    return float((below + fa * (above - below)) / h)


@kernel
def add_shares(row: FloatArray, alpha: float, beta: float, sign: float, grid: FloatArray) -> None:
    """Add sign * e(alpha, beta), the shares of all cells in the order of mu, to `row` in place."""
    first, last = cell_below(grid, beta), cell_above(grid, alpha)
    for i in range(first, last + 1):
        fa = min(max((alpha - grid[i]) / (grid[i + 1] - grid[i]), 0.0), 1.0)
        start = i * (i + 1) // 2
        for j in range(first, i + 1):
            fb = min(max((grid[j + 1] - beta) / (grid[j + 1] - grid[j]), 0.0), 1.0)
            share = fa * fb if i > j else max(0.0, fa + fb - 1.0)
            row[start + j] += sign * share
