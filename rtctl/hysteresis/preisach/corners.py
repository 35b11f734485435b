"""The Preisach output as a linear function of the Everett function at the grid's nodes: a few weights a sample.

A row of `preisach_regressors` holds the shares of all cells; the same sample is a handful of Everett values, each
between four nodes. Nodes are sums of cells, so products with the rows, and of the rows with each other, are sparse
ones first and running sums over the cells afterwards: thousands of rows of thousands of cells cost next to nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.preisach.everett import cell_above, cell_below, rising_grid
from rtctl.hysteresis.preisach.model import MAX_EXTREMA, cooled_stack, move_input
from rtctl.hysteresis.tables import inputs

CORNERS = 4


class CornerRows(NamedTuple):
    """Rows (samples, cells) of shares, kept as weights of nodes; node (a, b), a > b, is numbered as cell (a - 1, b)."""

    begins: IntArray
    """Offsets (samples + 1,) where each row's weights begin."""
    nodes: IntArray
    weights: FloatArray
    cells: int
    """Number of cells n along each field; there are n (n + 1) / 2 masses."""

    def of(self, mu: FloatArray) -> FloatArray:
        """Return rows @ mu (samples,)."""
        table = mu.copy()
        _sum_to_nodes(table, self.cells)
        return _weighted(self.begins, self.nodes, self.weights, table)

    def against(self, columns: FloatArray) -> FloatArray:
        """Return rows^T @ columns (masses, m) for columns (samples, m)."""
        found = _scattered(self.begins, self.nodes, self.weights, columns, self.masses)
        _sum_to_cells(found, self.cells)
        return found

    def gram(self) -> FloatArray:
        """Return rows^T @ rows (masses, masses)."""
        products = _products(self.begins, self.nodes, self.weights, self.masses)
        _sum_to_cells(products, self.cells)
        turned = np.ascontiguousarray(products.T)
        _sum_to_cells(turned, self.cells)
        return turned

    @property
    def masses(self) -> int:
        """Number of masses."""
        return self.cells * (self.cells + 1) // 2


def corner_rows(v: FloatArray, grid: FloatArray, wanted: NDArray[np.bool_]) -> CornerRows:
    """Return the rows of `preisach_regressors` from a full cooling, for the samples that are `wanted` (samples,)."""
    grid = rising_grid(grid)
    clipped = np.clip(inputs(v), grid[0], grid[-1])
    wanted = np.ascontiguousarray(wanted, dtype=bool)
    begins = _lengths(cooled_stack(grid), clipped, wanted)
    nodes, weights = _filled(cooled_stack(grid), clipped, grid, wanted, begins)
    return CornerRows(begins, nodes, weights, len(grid) - 1)


@kernel
def _lengths(stack: FloatArray, v: FloatArray, wanted: NDArray[np.bool_]) -> IntArray:
    begins = np.zeros(int(wanted.sum()) + 1, np.int64)
    row = 0
    for k in range(v.size):
        top = move_input(stack, v[k])
        if wanted[k]:
            begins[row + 1] = begins[row] + CORNERS * top
            row += 1
    return begins


@kernel
def _filled(
    stack: FloatArray, v: FloatArray, grid: FloatArray, wanted: NDArray[np.bool_], begins: IntArray
) -> tuple[IntArray, FloatArray]:
    nodes, weights = np.empty(begins[-1], np.int64), np.empty(begins[-1])
    level_nodes = np.zeros((MAX_EXTREMA, CORNERS), np.int64)
    level_weights = np.zeros((MAX_EXTREMA, CORNERS))
    known, row = 0, 0  # levels up to `known` are of the stack as it is
    for k in range(v.size):
        top = move_input(stack, v[k])
        known = min(known, top - 1)
        if not wanted[k]:
            continue
        for m in range(known + 1, top + 1):
            if m % 2 == 1:
                _corners(stack[1 + m], stack[m], 1.0, grid, level_nodes[m], level_weights[m])
            elif m > 0:
                _corners(stack[m], stack[1 + m], -1.0, grid, level_nodes[m], level_weights[m])
        known = top
        at = begins[row]
        for m in range(1, top + 1):
            for c in range(CORNERS):
                nodes[at], weights[at] = level_nodes[m, c], level_weights[m, c]
                at += 1
        row += 1
    return nodes, weights


@kernel
def _corners(
    alpha: float, beta: float, sign: float, grid: FloatArray, nodes: IntArray, weights: FloatArray
) -> None:
    """Add the nodes and weights (4,) around sign E(alpha, beta), see `everett.everett`."""
    i, j = cell_above(grid, alpha), cell_below(grid, beta)
    nodes[:] = 0
    weights[:] = 0.0
    if j > i:
        return
    fa = (alpha - grid[i]) / (grid[i + 1] - grid[i])
    fb = (grid[j + 1] - beta) / (grid[j + 1] - grid[j])
    above = i * (i + 1) // 2 + j
    nodes[0] = above
    if i == j:
        weights[0] = sign * max(0.0, fa + fb - 1.0)
        return
    weights[0] = sign * fa * fb
    nodes[1], weights[1] = above + 1, sign * fa * (1.0 - fb)
    below = (i - 1) * i // 2 + j
    nodes[2], weights[2] = below, sign * (1.0 - fa) * fb
    if i > j + 1:  # else the node is on the diagonal, where E is 0
        nodes[3], weights[3] = below + 1, sign * (1.0 - fa) * (1.0 - fb)


@kernel
def _weighted(begins: IntArray, nodes: IntArray, weights: FloatArray, table: FloatArray) -> FloatArray:
    found = np.zeros(begins.size - 1)
    for row in range(found.size):
        for k in range(begins[row], begins[row + 1]):
            found[row] += weights[k] * table[nodes[k]]
    return found


@kernel
def _scattered(
    begins: IntArray, nodes: IntArray, weights: FloatArray, columns: FloatArray, masses: int
) -> FloatArray:
    found = np.zeros((masses, columns.shape[1]))
    for row in range(begins.size - 1):
        for k in range(begins[row], begins[row + 1]):
            for m in range(columns.shape[1]):
                found[nodes[k], m] += weights[k] * columns[row, m]
    return found


@kernel
def _products(begins: IntArray, nodes: IntArray, weights: FloatArray, masses: int) -> FloatArray:
    found = np.zeros((masses, masses))
    for row in range(begins.size - 1):
        for k in range(begins[row], begins[row + 1]):
            if weights[k] != 0.0:
                for m in range(begins[row], begins[row + 1]):
                    found[nodes[k], nodes[m]] += weights[k] * weights[m]
    return found


@kernel
def _sum_to_nodes(table: FloatArray, n: int) -> None:
    """Turn masses (masses,) into E at the nodes, in place: the sum over i < a and j >= b."""
    for i in range(n):
        begin, before = i * (i + 1) // 2, (i - 1) * i // 2
        for j in range(i - 1, -1, -1):
            table[begin + j] += table[begin + j + 1]
        for j in range(i):
            table[begin + j] += table[before + j]


@kernel
def _sum_to_cells(table: FloatArray, n: int) -> None:
    """Apply the transpose: turn the value of each node (masses, m) into that of each cell, in place."""
    for i in range(n - 2, -1, -1):
        begin, after = i * (i + 1) // 2, (i + 1) * (i + 2) // 2
        for j in range(i + 1):
            _add_row(table, begin + j, after + j)
    for i in range(n):
        begin = i * (i + 1) // 2
        for j in range(1, i + 1):
            _add_row(table, begin + j, begin + j - 1)


@kernel
def _add_row(table: FloatArray, to: int, other: int) -> None:
    """Add a row to another one, without a slice: numba would compile the words of an error about its shape."""
    for m in range(table.shape[1]):
        table[to, m] += table[other, m]
