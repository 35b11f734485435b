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
from rtctl.plots.elements.decimation import path_points, visited
from rtctl.plots.elements.style import BLACK, BLUE, VERMILION

JUMP = 0.2
"""Share of a plane's width or height from which a move between two samples is a jump."""
MOST_JUMPS = 60
"""Jumps up to which the path is drawn as a line; with more, samples are drawn as dots."""


class _Curve(NamedTuple):
    """One set of points over a plane's x."""

    values: FloatArray
    color: str
    width: float


def draw_planes(
    rows: Sequence[Axes], column: Mapping[str, FloatArray], window: slice | None, profile: DeviceProfile
) -> None:
    """Fill three axes from `column`, all samples or a `window`: as a path, or as dots where it jumps about."""
    moved = [
        one for one in profile.commands if (column[one.name] != column[one.name][0]).any()
    ] or profile.commands
    command = shown(moved[-1], column[moved[-1].name])
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
    part = slice(None) if window is None else window
    for curve in curves:
        x, y = across.values[part], curve.values[part]
        if not np.isfinite(y).any():
            continue
        if count_jumps(x, y) <= MOST_JUMPS:
            kept = path_points(x, y)
            axes.plot(x[kept], y[kept], linewidth=curve.width, color=curve.color)
        else:  # lines from jump to jump would be a scribble
            kept = visited(x, y)
            axes.plot(
                x[kept], y[kept], ".", markersize=2.6 * curve.width, markeredgewidth=0.0, color=curve.color
            )
    axes.set_xlabel(across.label)
    axes.set_ylabel(up.label)
    scale_axis(axes, "x", across)
    scale_axis(axes, "y", up)


def count_jumps(x: FloatArray, y: FloatArray) -> int:
    """Return how often a path (n,) moves by more than `JUMP` of its width or height from one sample to the next."""
    far = np.zeros(max(len(x) - 1, 0), dtype=bool)
    for values in (x, y):
        finite = values[np.isfinite(values)]
        width = float(np.ptp(finite)) if len(finite) else 0.0
        with np.errstate(invalid="ignore"):
            far |= np.abs(np.diff(values)) > JUMP * width if width > 0.0 else False
    return int(np.count_nonzero(far))
