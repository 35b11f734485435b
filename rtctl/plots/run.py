"""One figure of a run: tracking, errors, commands and readings, and loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import ArrayLike

from rtctl.border.arrays import FloatArray
from rtctl.border.records import Channel, DeviceProfile, Mark
from rtctl.output.readable_units import printed_unit, readable
from rtctl.plots.elements.channels import Shown, label_of, scale_axis, shown
from rtctl.plots.elements.errors import ErrorFigures, error_figures, percent
from rtctl.plots.elements.limits import limit_axis
from rtctl.plots.elements.lines import ABOVE, draw_line
from rtctl.plots.elements.planes import draw_planes
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    RAIL,
    VERMILION,
    headline,
    house_style,
    new_figure,
    save_png,
)
from rtctl.plots.run_errors import draw_errors

SMALL = 0.01
"""Errors below it are told in the unit that fits them, the others in the output's own."""
FOLLOWED = ("setpoint", "estimate")
"""Signals that each controlled output has."""
LABEL_IN_ONE_LINE = 16
"""Letters that fit beside one of the low panels."""
MOST_TEXTS = 12
"""Marks that have room for their text."""
MOST_TURNS = 60
"""Turning points of the setpoint that one panel can show."""


# 8 parameters because all but the path are those of the figure
def plot_run(  # noqa: PLR0913
    path: Path,
    time_s: ArrayLike,
    signals: Mapping[str, ArrayLike],
    *,
    title: str,
    closed_loop: bool,
    output_range: float,
    profile: DeviceProfile,
    marks: Sequence[Mark] = (),
) -> None:
    """Write the figure of a run as a PNG file.

    `signals` has (n,) arrays under the names of the profile's channels, and setpoint, estimate and
    estimate_standard_error in the unit of its reference; NaN where there is none (no external instrument, no
    setpoint in an open-loop run). Percents refer to
    `output_range` in that unit. `marks` are moments at which something was changed.
    Raises ValueError where a signal is missing or has another length than `time_s` [s].
    """
    figure = run_figure(
        time_s, signals, title=title, closed_loop=closed_loop, output_range=output_range, profile=profile, marks=marks,
    )  # fmt: skip
    save_png(figure, path, "run")


def run_figure(
    time_s: ArrayLike,
    signals: Mapping[str, ArrayLike],
    *,
    title: str,
    closed_loop: bool,
    output_range: float,
    profile: DeviceProfile,
    marks: Sequence[Mark] = (),
) -> Figure:
    """Return the figure that `plot_run` writes."""
    time, column = np.asarray(time_s, np.float64), _columns(time_s, signals, profile)
    if not closed_loop:
        column["setpoint"] = np.full(len(time), np.nan)
    window = _last_cycles(column["setpoint"])
    width = output_range
    panels = _panels(column, profile)
    with house_style():
        low = len(panels) + len(_further_outputs(profile, column))
        figure = new_figure(11.5, (8.4 if window is None else 9.6) + 1.1 * (low - 2))
        beside = figure.add_gridspec(1, 2, width_ratios=(2.3, 1.0))
        left, right = figure.add_subfigure(beside[0, 0]), figure.add_subfigure(beside[0, 1])
        draw_planes(list(right.subplots(3, 1)), column, window, profile)
        rows = _draw_against_time(left, time, column, width, window, profile, panels)
        _draw_marks(rows, marks)
        if _further_outputs(profile, column):
            title = f"{title}, {profile.reference.name}"  # what is told below
        headline(figure, *_finding(title, column, width, profile.reference))
    return figure


def _columns(
    time_s: ArrayLike, signals: Mapping[str, ArrayLike], profile: DeviceProfile
) -> dict[str, FloatArray]:
    channels = (profile.reference, *profile.sensed, *profile.commands)
    names = ("setpoint", "estimate", *(channel.name for channel in channels), "estimate_standard_error")
    missing = [name for name in names if name not in signals]
    if missing:
        raise ValueError(f"a run's figure needs {', '.join(names)}; missing: {', '.join(missing)}")
    further = [f"{word}_{one.name}" for one in _further_outputs(profile, signals) for word in FOLLOWED]
    column = {name: np.asarray(signals[name], np.float64) for name in (*names, *further)}
    for name, values in column.items():  # infinite standard error: the estimator claims nothing
        column[name] = np.where(np.isfinite(values), values, np.nan)
    shape = np.shape(time_s)
    wrong = [f"{name} {values.shape}" for name, values in column.items() if values.shape != shape]
    if wrong or len(shape) != 1 or shape[0] < 2:
        raise ValueError(
            f"time has shape {shape}; each signal needs the same, two samples or more: {', '.join(wrong)}"
        )
    return column


def _further_outputs(profile: DeviceProfile, signals: Mapping[str, ArrayLike]) -> list[Channel]:
    """Return the readings that have a setpoint of their own."""
    return [one for one in profile.sensed if f"setpoint_{one.name}" in signals]


def _panels(column: Mapping[str, FloatArray], profile: DeviceProfile) -> list[list[Shown]]:
    """Return the panels below the errors: every command, then the readings that share a unit."""
    panels = [[shown(channel, column[channel.name])] for channel in profile.commands]
    followed = _further_outputs(profile, column)
    read = [channel for channel in profile.sensed if channel not in followed]
    for unit in dict.fromkeys(channel.unit for channel in read):
        panels.append([shown(c, column[c.name]) for c in read if c.unit == unit])
    return panels


def _draw_against_time(
    left: SubFigure,
    time: FloatArray,
    column: Mapping[str, FloatArray],
    width: float,
    window: slice | None,
    profile: DeviceProfile,
    panels: Sequence[Sequence[Shown]],
) -> list[Axes]:
    """Draw every panel against time; return those that show the whole run."""
    output, further = profile.reference, _further_outputs(profile, column)
    heights = [2.6, 1.9] if window is None else [2.2, 1.3, 1.7]
    heights += (len(panels) + len(further)) * [1.0 if window is None else 0.9]
    rows = list(left.subplots(len(heights), 1, height_ratios=heights))
    top = rows[0] if window is None else rows.pop(0)
    _draw_following(rows[0], time, column, output)
    if window is not None:
        _draw_window(top, rows[0], time, column, window, output)
    if top.lines:
        top.legend(**ABOVE)
    draw_errors(rows[1], time, column, width, output)
    for axes, one in zip(rows[2:], further, strict=False):
        _draw_following(axes, time, column, one, f"_{one.name}")
    for axes, panel in zip(rows[2 + len(further) :], panels, strict=True):
        _draw_panel(axes, time, panel)
    rows[-1].set_xlabel("time [s]")
    for axes in rows:
        axes.set_xlim(time[0], time[-1])
        axes.tick_params(labelbottom=axes is rows[-1])
    left.align_ylabels()
    return rows


def _draw_marks(rows: Sequence[Axes], marks: Sequence[Mark]) -> None:
    """Draw what was changed while the run lasted: a line in each panel, its text in the first."""
    for mark in marks:
        for axes in rows:
            axes.axvline(mark.time_s, color=GREEN, linewidth=1.0, linestyle="--", zorder=1.5)
    for mark in marks[:MOST_TEXTS]:
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
        rows[0].annotate(
            printed_unit(mark.text), (mark.time_s, 0.02), xycoords=("data", "axes fraction"), xytext=(2, 0),
            textcoords="offset points", rotation=90, va="bottom", fontsize=7.5, color=GREEN, bbox=box,
        )  # fmt: skip


def _draw_panel(axes: Axes, time: FloatArray, panel: Sequence[Shown]) -> None:
    for channel, color in zip(panel, (BLACK, VERMILION, BLUE, GREY), strict=False):
        draw_line(axes, time, channel.values, color, channel.label if len(panel) > 1 else "")
    if len(panel) > 1 and axes.lines:
        axes.legend(**ABOVE)
    if not panel[0].is_logarithmic:
        limit_axis(axes, *(channel.values for channel in panel))
    label = panel[0].label if len(panel) == 1 else f"readings {panel[0].unit}"
    axes.set_ylabel(label if len(label) <= LABEL_IN_ONE_LINE else label.replace(" [", "\n["))
    axes.ticklabel_format(axis="y", useOffset=False)
    scale_axis(axes, "y", panel[0])


def _draw_following(
    axes: Axes, time: FloatArray, column: Mapping[str, FloatArray], output: Channel, ending: str = ""
) -> None:
    """Draw setpoint, reading and estimate of an output; `ending` is that of a further output's signals."""
    setpoint, estimate = (column[f"{word}{ending}"] for word in FOLLOWED)
    draw_line(axes, time, setpoint, RAIL, "setpoint", 3.5)
    draw_line(axes, time, column[output.name], BLUE, f"{output.name} (external instrument)", 1.3)
    draw_line(axes, time, estimate, VERMILION, "estimate", 0.9)
    limit_axis(axes, setpoint, column[output.name], estimate)
    axes.set_ylabel(label_of(output))


def _last_cycles(setpoint: FloatArray) -> slice | None:
    """Return the last samples of a setpoint that turns too often for one panel; None where all can be seen."""
    slope = np.sign(np.diff(setpoint))
    turns = np.flatnonzero(slope[1:] * slope[:-1] < 0.0) + 1
    return slice(int(turns[-MOST_TURNS // 2]), len(setpoint)) if len(turns) > MOST_TURNS else None


def _draw_window(
    axes: Axes,
    whole: Axes,
    time: FloatArray,
    column: Mapping[str, FloatArray],
    window: slice,
    output: Channel,
) -> None:
    """Draw the last cycles magnified, and mark where they lie in the whole run."""
    _draw_following(axes, time[window], {name: values[window] for name, values in column.items()}, output)
    axes.set_xlim(time[window][0], time[-1])
    axes.set_xlabel(f"time [s], the last {time[-1] - time[window][0]:.2g} s (loops on the right)")
    whole.axvspan(time[window][0], time[-1], color=GREY, alpha=0.35, linewidth=0.0)


def _finding(title: str, column: Mapping[str, FloatArray], width: float, output: Channel) -> tuple[str, str]:
    """Return the headline and the line under it."""
    tracking = error_figures(column["setpoint"] - column[output.name], width)
    sensing = error_figures(column["estimate"] - column[output.name], width)
    first = tracking or sensing
    if first is None:
        return f"{title}: no external instrument, errors unknown", ""
    verb, unit = "tracks" if tracking else "self-senses", printed_unit(output.unit)
    finding = f"{title}: {verb} to {percent(first.mean_percent)} of range on average"
    reach = f"range {width:.1f} {unit}" if width >= 10.0 else f"range {width:.3g} {unit}"
    parts = [
        _in_words("tracking", tracking, output.unit),
        _in_words("self-sensing", sensing, output.unit),
        reach,
    ]
    return finding, " · ".join(part for part in parts if part)


def _in_words(name: str, figures: ErrorFigures | None, unit: str) -> str:
    if figures is None:
        return ""
    digits = ".2f" if figures.largest >= 1.0 else ".2g"
    mean, largest = (
        f"{value:{digits}} {printed_unit(unit)}" if value >= SMALL else printed_unit(readable(value, unit, 3))
        for value in (figures.mean, figures.largest)
    )
    return f"{name} error mean {mean} ({percent(figures.mean_percent)}), max {largest} ({percent(figures.max_percent)})"
