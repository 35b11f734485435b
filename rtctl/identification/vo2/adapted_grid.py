"""A Preisach grid with small cells where the relays' density changes, for films whose few domains switch at once.

The output of a piecewise constant density errs by the change of the density within a cell, times the cell's width. The
error of a given number of cells is least when their widths are inversely proportional to the square root of the
density's slope (C. de Boor, "Good approximation by splines with variable knots", 1973). The densities are those of the
model's own masses along either switching field, so a grid follows from a fit on another one, and a better one from a
second fit.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.hysteresis.preisach.model import PreisachModel

UNIFORM_SHARE = 0.3
"""Share of the cells that is spread uniformly: a density may be zero somewhere for want of data."""


def adapt_nodes(model: PreisachModel, cells: int) -> FloatArray:
    """Return nodes (cells + 1,) over the range of the model's grid, dense where its masses change most."""
    widths = np.diff(model.grid)
    middles = 0.5 * (model.grid[1:] + model.grid[:-1])
    bend = np.zeros(len(widths))
    for density in compute_switching_densities(model):
        slope = np.pad(np.abs(np.diff(density)) / np.diff(middles), 1)  # beyond the range nothing is known
        bend += np.sqrt(np.maximum(slope[1:], slope[:-1])) * widths
    uniform = widths / widths.sum()
    share = (1.0 - UNIFORM_SHARE) * bend / bend.sum() + UNIFORM_SHARE * uniform if bend.any() else uniform
    cumulative = np.concatenate(([0.0], np.cumsum(share)))
    nodes: FloatArray = np.interp(np.linspace(0.0, cumulative[-1], cells + 1), cumulative, model.grid)
    return nodes


def compute_switching_densities(model: PreisachModel) -> tuple[FloatArray, FloatArray]:
    """Return the mass that switches on heating and on cooling over each cell (n,) [y unit / v unit]."""
    widths = np.diff(model.grid)
    up, down = (np.bincount(field, model.mu, len(widths)) / widths for field in np.tril_indices(len(widths)))
    return up, down
