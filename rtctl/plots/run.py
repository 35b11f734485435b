"""One figure of a run: does it follow, how far off is it, what did it command and sense, on which loops."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import ArrayLike, NDArray

from rtctl.plots.errors import ErrorFigures, error_figures, percent
from rtctl.plots.lines import ABOVE, draw_line
from rtctl.plots.planes import draw_planes
from rtctl.plots.run_errors import draw_errors
from rtctl.plots.style import (
    BLACK,
    BLUE,
    GREY,
    RAIL,
    VERMILION,
    headline,
    house_style,
    kilo,
    new_figure,
    save_png,
)

FloatArray = NDArray[np.float64]

SIGNALS = ("setpoint", "estimate", "deflection", "resistance", "current", "estimate_standard_error")

MOST_TURNS = 60
"""Turning points of the setpoint that one panel can show."""


def plot_run(
    path: Path,
    time_s: ArrayLike,
    signals: Mapping[str, ArrayLike],
    *,
    title: str,
    closed_loop: bool,
    range_um: float,
) -> None:
    """Write the figure of a run as a PNG file.

    `signals` has (n,) arrays under the names in `SIGNALS` [um, um, um, ohm, mA, um]; NaN where there is none
    (no external instrument, no setpoint in an open-loop run). Percents refer to `range_um` [um].
    Raises ValueError where a signal is missing or has another length than `time_s` [s].
    """
    save_png(run_figure(time_s, signals, title=title, closed_loop=closed_loop, range_um=range_um), path)


def run_figure(
    time_s: ArrayLike, signals: Mapping[str, ArrayLike], *, title: str, closed_loop: bool, range_um: float
) -> Figure:
    """The figure that `plot_run` writes."""
    time, column = np.asarray(time_s, np.float64), _columns(time_s, signals)
    if not closed_loop:
        column["setpoint"] = np.full(len(time), np.nan)
    window = _last_cycles(column["setpoint"])
    with house_style():
        figure = new_figure(11.5, 8.4 if window is None else 9.6)
        beside = figure.add_gridspec(1, 2, width_ratios=(2.3, 1.0))
        left, right = figure.add_subfigure(beside[0, 0]), figure.add_subfigure(beside[0, 1])
        draw_planes(list(right.subplots(3, 1)), column, window)
        _draw_against_time(left, time, column, range_um, window)
        headline(figure, *_finding(title, column, range_um))
    return figure


def _columns(time_s: ArrayLike, signals: Mapping[str, ArrayLike]) -> dict[str, FloatArray]:
    missing = [name for name in SIGNALS if name not in signals]
    if missing:
        raise ValueError(f"a run's figure needs {', '.join(SIGNALS)}; missing: {', '.join(missing)}")
    column = {name: np.asarray(signals[name], np.float64) for name in SIGNALS}
    for name, values in column.items():  # infinite standard error: the estimator claims nothing
        column[name] = np.where(np.isfinite(values), values, np.nan)
    shape = np.shape(time_s)
    wrong = [f"{name} {values.shape}" for name, values in column.items() if values.shape != shape]
    if wrong or len(shape) != 1 or shape[0] < 2:
        raise ValueError(
            f"time has shape {shape}; each signal needs the same, two samples or more: {', '.join(wrong)}"
        )
    return column


def _draw_against_time(
    left: SubFigure, time: FloatArray, column: Mapping[str, FloatArray], range_um: float, window: slice | None
) -> None:
    heights = (2.6, 1.9, 1.0, 1.0) if window is None else (2.2, 1.3, 1.7, 0.9, 0.9)
    rows = list(left.subplots(len(heights), 1, height_ratios=heights))
    top = rows[0] if window is None else rows.pop(0)
    _draw_following(rows[0], time, column)
    if window is not None:
        _draw_window(top, rows[0], time, column, window)
    if top.lines:
        top.legend(**ABOVE)
    draw_errors(rows[1], time, column, range_um)
    draw_line(rows[2], time, column["current"], BLACK)
    draw_line(rows[3], time, column["resistance"] / 1e3, BLACK)
    rows[2].set_ylabel("current [mA]")
    rows[3].set_ylabel("resistance [kΩ]")
    rows[3].set_xlabel("time [s]")
    kilo(rows[3], "y")
    for axes in rows:
        axes.set_xlim(time[0], time[-1])
        axes.tick_params(labelbottom=axes is rows[3])
    left.align_ylabels()


def _draw_following(axes: Axes, time: FloatArray, column: Mapping[str, FloatArray]) -> None:
    draw_line(axes, time, column["setpoint"], RAIL, "setpoint", 3.5)
    draw_line(axes, time, column["deflection"], BLUE, "deflection (external instrument)", 1.3)
    draw_line(axes, time, column["estimate"], VERMILION, "estimate", 0.9)
    axes.set_ylabel("deflection [µm]")


def _last_cycles(setpoint: FloatArray) -> slice | None:
    """The last samples of a setpoint that turns too often for one panel; None where all can be seen."""
    slope = np.sign(np.diff(setpoint))
    turns = np.flatnonzero(slope[1:] * slope[:-1] < 0.0) + 1
    return slice(int(turns[-MOST_TURNS // 2]), len(setpoint)) if len(turns) > MOST_TURNS else None


def _draw_window(
    axes: Axes, whole: Axes, time: FloatArray, column: Mapping[str, FloatArray], window: slice
) -> None:
    """The last cycles magnified, and where they lie in the whole run."""
    _draw_following(axes, time[window], {name: values[window] for name, values in column.items()})
    axes.set_xlim(time[window][0], time[-1])
    axes.set_xlabel(f"time [s], the last {time[-1] - time[window][0]:.2g} s (loops on the right)")
    whole.axvspan(time[window][0], time[-1], color=GREY, alpha=0.35, linewidth=0.0)


def _finding(title: str, column: Mapping[str, FloatArray], range_um: float) -> tuple[str, str]:
    """The headline and the line under it."""
    tracking = error_figures(column["setpoint"] - column["deflection"], range_um)
    sensing = error_figures(column["estimate"] - column["deflection"], range_um)
    first = tracking or sensing
    if first is None:
        return f"{title}: no external instrument, errors unknown", ""
    verb = "tracks" if tracking else "self-senses"
    finding = f"{title}: {verb} to {percent(first.mean_percent)} of range on average"
    parts = [_in_words("tracking", tracking), _in_words("self-sensing", sensing)]
    return finding, " · ".join([part for part in parts if part] + [f"range {range_um:.1f} µm"])


def _in_words(name: str, figures: ErrorFigures | None) -> str:
    if figures is None:
        return ""
    mean, largest = f"{figures.mean:.2f} µm ({percent(figures.mean_percent)})", f"{figures.largest:.2f} µm"
    return f"{name} error mean {mean}, max {largest} ({percent(figures.max_percent)})"
