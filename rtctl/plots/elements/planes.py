"""Planes of a run: the last command against first reading and output, and readings against each other or the output.

Of a VO2 actuator these are R–I, D–I and D–R; of a resonator the response and backbone against frequency, and X–Y.
The instrument's output lies under the estimate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.border.records import DeviceProfile
from rtctl.plots.elements.channels import Shown, scale_axis, shown
from rtctl.plots.elements.decimation import path_points
from rtctl.plots.elements.style import BLACK, BLUE, VERMILION


class _Curve(NamedTuple):
    """One set of points over a plane's x."""

    values: FloatArray
    color: str
    width: float


def draw_planes(
    rows: Sequence[Axes], column: Mapping[str, FloatArray], window: slice | None, profile: DeviceProfile
) -> None:
    """Fill three axes from `column`: the path through all samples, or through those of a `window`."""
    command = shown(profile.commands[-1], column[profile.commands[-1].name])
    readings = [shown(channel, column[channel.name]) for channel in profile.sensed]
    output = shown(profile.reference, column[profile.reference.name])
    estimate = shown(profile.reference, column["estimate"])
    first = [_Curve(readings[0].values, BLACK, 1.0)]
    both = [_Curve(output.values, BLUE, 1.6), _Curve(estimate.values, VERMILION, 0.8)]
    _draw_plane(rows[0], command, readings[0], first, window)
    _draw_plane(rows[1], command, output, both, window)
    if len(readings) > 1:
        _draw_plane(rows[2], readings[0], readings[1], [_Curve(readings[1].values, BLACK, 1.0)], window)
    else:
        _draw_plane(rows[2], readings[0], output, both, window)


def _draw_plane(axes: Axes, across: Shown, up: Shown, curves: Sequence[_Curve], window: slice | None) -> None:
    for curve in curves:
        part = slice(None) if window is None else window
        _draw_loops(axes, across.values[part], curve.values[part], curve.color, curve.width)
    axes.set_xlabel(across.label)
    axes.set_ylabel(up.label)
    scale_axis(axes, "x", across)
    scale_axis(axes, "y", up)


def _draw_loops(axes: Axes, x: FloatArray, y: FloatArray, color: str, width: float) -> None:
    if np.isfinite(y).any():
        kept = path_points(x, y)
        axes.plot(x[kept], y[kept], linewidth=width, color=color)
