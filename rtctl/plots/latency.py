"""Complementary distributions of lateness and round trip, both axes logarithmic."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.elements.style import BLACK, CYCLE, GREY, headline, house_style, new_figure, save_png
from rtctl.timing.histogram import Histogram


class Curve(NamedTuple):
    """One histogram of durations under a name."""

    name: str
    histogram: Histogram
    period_s: float | None = None
    """Sample period, drawn beside it [s]; None: there is none."""


def plot_latency(
    path: Path,
    lateness: Sequence[Curve],
    round_trip: Sequence[Curve],
    reference: Histogram | None,
    title: str,
) -> None:
    """Draw two panels into `path` (PNG): lateness with cyclictest's (if measured), round trips."""
    with house_style():
        figure = new_figure(10.0, 4.6)
        left, right = figure.subplots(1, 2, sharey=True)
        if reference is not None:
            _draw(left, Curve("cyclictest", reference), BLACK, "--")
        for axes, curves in ((left, lateness), (right, round_trip)):
            for curve, colour in zip(curves, CYCLE, strict=False):
                _draw(axes, curve, colour)
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_ylim(top=1.3)
            axes.axhline(0.01, color=GREY, linewidth=0.7, linestyle=":")
            for period_s in sorted({one.period_s for one in curves if one.period_s is not None}):
                axes.axvline(1e6 * period_s, color=GREY, linewidth=1.2, linestyle="--",
                             label=f"period, {1e3 * period_s:g} ms")  # fmt: skip
            axes.legend(**ABOVE | {"ncols": 2})
        left.set_xlabel("lateness after the deadline [µs]")
        right.set_xlabel("round trip [µs]")
        left.set_ylabel("share of steps that took longer")
        headline(figure, title)
    save_png(figure, path, "latency")


def _draw(axes: Axes, curve: Curve, colour: str, style: str = "-") -> None:
    buckets = list(curve.histogram.buckets())
    if not buckets:
        return
    high_us = np.array([max(bucket.high_ns, 10) * 1e-3 for bucket in buckets])
    counts = np.array([bucket.durations for bucket in buckets], dtype=np.float64)
    beyond = 1.0 - np.cumsum(counts) / counts.sum()
    x = np.concatenate((high_us[:1], high_us))
    y = np.concatenate(([1.0], beyond))
    shown = y > 0.5 / counts.sum()
    axes.step(x[shown], y[shown], where="post", color=colour, linestyle=style, label=curve.name)
