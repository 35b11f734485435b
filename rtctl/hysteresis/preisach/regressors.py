"""The Preisach output as a linear function of its masses: y = c + sign (rows @ mu) + c1 v + c2 v^2.

Row k holds the share of each cell that is on at sample k; with mu >= 0 the identification is a non-negative
least squares. The stack of extrema is that of `preisach`, with a row of shares in the place of each H_m. Fits use the
same rows as weights of nodes, a tenth of the work: `preisach_corners`, of which these are the readable form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.preisach.everett import add_shares, rising_grid
from rtctl.hysteresis.preisach.model import cooled_stack, move_input
from rtctl.hysteresis.tables import inputs


def preisach_regressors(
    v: FloatArray,
    grid: FloatArray,
    state: FloatArray | None = None,
    wanted: NDArray[np.bool_] | None = None,
) -> FloatArray:
    """Return rows (samples, cells) for the inputs v (samples,), in the order of `everett.cell_index`.

    They start from a full cooling, or from the stack of a model's `state`, which is not modified. Inputs are clipped
    to the grid. Only the samples that are `wanted` give a row.
    """
    grid = rising_grid(grid)
    stack = cooled_stack(grid) if state is None else state.copy()
    v = inputs(v)
    wanted = np.ones(len(v), dtype=bool) if wanted is None else np.ascontiguousarray(wanted, dtype=bool)
    return _regressors(stack, np.clip(v, grid[0], grid[-1]), grid, wanted)


@kernel
def _regressors(stack: FloatArray, v: FloatArray, grid: FloatArray, wanted: NDArray[np.bool_]) -> FloatArray:
    n = grid.size - 1
    cells = n * (n + 1) // 2
    rows = np.empty((int(wanted.sum()), cells))
    levels = np.zeros((stack.size // 2, cells))
    filled, row = 0, 0  # levels below `filled` are of the stack as it is
    for k in range(v.size):
        top = move_input(stack, v[k])
        filled = min(filled, top)
        if not wanted[k]:
            continue
        for m in range(filled, top + 1):
            _fill_level(levels, m, stack, grid)
        filled = top + 1
        for cell in range(cells):
            rows[row, cell] = levels[top, cell]
        row += 1
    return rows


@kernel
def _fill_level(levels: FloatArray, m: int, stack: FloatArray, grid: FloatArray) -> None:
    """Compute the shares at the extremum s_m (stack[1 + m]) from those at s_{m-1}."""
    if m == 0:
        levels[0] = 0.0
    elif m % 2 == 1:
        levels[m] = levels[m - 1]
        add_shares(levels[m], stack[1 + m], stack[m], 1.0, grid)
    else:
        levels[m] = levels[m - 1]
        add_shares(levels[m], stack[m], stack[1 + m], -1.0, grid)
