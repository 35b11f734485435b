"""Lines against time, and where their legend and notes stand."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.plots.elements.decimation import extremes
from rtctl.plots.elements.style import few_decades

ABOVE: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 3, "borderaxespad": 0.1}
"""Place of a legend in one row over the panel, where it hides nothing."""

FEW_DECADES = 5e3
"""Ratio of the ends of an axis up to which three ticks a decade have room."""


def draw_line(
    axes: Axes, time_s: FloatArray, values: FloatArray, color: str, label: str = "", width: float = 1.0
) -> None:
    """Draw a line (n,) against time through the extremes of its buckets; nothing without numbers."""
    if np.isfinite(values).any():
        kept = extremes(values)
        axes.plot(time_s[kept], values[kept], color=color, linewidth=width, label=label or "_unlabelled")


def tick_frequencies(axes: Axes) -> None:
    """Let a logarithmic x axis over a few decades read 10, 20, 50, 100."""
    low, high = axes.get_xlim()
    if high < FEW_DECADES * low:
        few_decades(axes.xaxis)


def note(axes: Axes, text: str) -> None:
    """Write a remark in the lower right corner, legible over data."""
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    axes.text(0.995, 0.03, text, transform=axes.transAxes, ha="right", fontsize=9.0, bbox=box)
