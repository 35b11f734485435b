"""Limits of an axis that single spikes do not stretch; what lies beyond them is counted in the panel.

A spike is what lies farther from the bulk of the samples than the bulk is wide, and is rarer than one sample in a
thousand: a sine, steps, noise and a slow transient are shown whole.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.plots.elements.lines import note

RARE = 0.05
"""Percent of the samples on either side that may be spikes."""
FAR = 1.0
"""Widths of the bulk beyond its edge from which a rare sample is a spike."""
ROOM = 0.05
"""Share of the width that is left free at the edges."""
FEWEST = 400
"""Samples below which one is no rare one."""


def robust_limits(*values: FloatArray) -> tuple[float, float, int]:
    """Return lower and upper limit of an axis of `values`, and how many finite samples lie beyond them.

    (0, 1, 0) where there is no number.
    """
    every = np.concatenate([one[np.isfinite(one)] for one in values]) if values else np.empty(0)
    if not len(every):
        return 0.0, 1.0, 0
    low, high = float(every.min()), float(every.max())
    if len(every) >= FEWEST:
        inner = np.percentile(every, [RARE, 100.0 - RARE]).tolist()
        width = inner[1] - inner[0]
        bulk = every[(every >= inner[0] - FAR * width) & (every <= inner[1] + FAR * width)]
        low, high = float(bulk.min()), float(bulk.max())
    beyond = int(np.count_nonzero((every < low) | (every > high)))
    room = ROOM * (high - low) or (ROOM * abs(high) or 1.0)
    return low - room, high + room, beyond


def limit_axis(axes: Axes, *values: FloatArray) -> None:
    """Set the y limits to the bulk of `values` where they have spikes, and say how many samples lie beyond."""
    low, high, beyond = robust_limits(*values)
    if beyond:
        axes.set_ylim(low, high)
        note_beyond(axes, beyond)


def note_beyond(axes: Axes, count: int) -> None:
    """Say how many samples lie beyond the axis."""
    note(axes, f"{count} sample{'s' if count > 1 else ''} beyond this axis")
