"""Hysteresis planes of a run: R–I, D–I and D–R, the instrument's deflection under the estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from rtctl.plots.decimation import extremes, visited
from rtctl.plots.style import BLACK, BLUE, VERMILION, kilo

FloatArray = NDArray[np.float64]


def draw_planes(rows: Sequence[Axes], column: Mapping[str, FloatArray], window: slice | None) -> None:
    """Fill three axes from `column` [mA, ohm, um]: all samples as dots, or a `window` as lines."""
    current, resistance = column["current"], column["resistance"] / 1e3
    deflection = [(column["deflection"], BLUE, 1.6), (column["estimate"], VERMILION, 0.8)]
    panels = (
        (rows[0], current, "current [mA]", [(resistance, BLACK, 1.0)], "resistance [kΩ]"),
        (rows[1], current, "current [mA]", deflection, "deflection [µm]"),
        (rows[2], resistance, "resistance [kΩ]", deflection, "deflection [µm]"),
    )
    for axes, x, x_label, curves, y_label in panels:
        for y, color, width in curves:
            if window is None:
                _draw_dots(axes, x, y, color, 2.6 * width)
            else:
                _draw_loops(axes, x[window], y[window], color, width)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
    kilo(rows[0], "y")
    kilo(rows[2], "x")


def _draw_dots(axes: Axes, x: FloatArray, y: FloatArray, color: str, size: float) -> None:
    kept = visited(x, y)
    axes.plot(x[kept], y[kept], ".", markersize=size, markeredgewidth=0.0, color=color)


def _draw_loops(axes: Axes, x: FloatArray, y: FloatArray, color: str, width: float) -> None:
    if np.isfinite(y).any():
        kept = extremes(y)
        axes.plot(x[kept], y[kept], linewidth=width, color=color)
