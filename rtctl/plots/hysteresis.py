"""The device's own hysteresis, as the paper's figures 4 and 5: excitation, R–I, D–I, R, D–R and its zoom."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike, NDArray

from rtctl.border.arrays import FloatArray
from rtctl.plots.elements.channels import Shown, scale_axis, shown_signal
from rtctl.plots.elements.decimation import extremes, path_points
from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    VERMILION,
    headline,
    house_style,
    new_figure,
    save_png,
)
from rtctl.plots.loops import Outside, leaves_major_loop, window_around


def plot_hysteresis(
    path: Path, current_mA: ArrayLike, resistance_ohm: ArrayLike, deflection_um: ArrayLike, *, title: str
) -> None:
    """Write the figure of steady states (n,) in the order they were visited as a PNG file.

    Deflection may be NaN (no external instrument). The zoom shows where minor loops leave the major one.
    Raises ValueError where lengths differ, with fewer than three samples or where resistance is not > 0 ohm.
    """
    save_png(hysteresis_figure(current_mA, resistance_ohm, deflection_um, title=title), path)


def hysteresis_figure(
    current_mA: ArrayLike, resistance_ohm: ArrayLike, deflection_um: ArrayLike, *, title: str
) -> Figure:
    """Return the figure that `plot_hysteresis` writes."""
    current, resistance, deflection = (
        np.asarray(values, np.float64) for values in (current_mA, resistance_ohm, deflection_um)
    )
    if not (current.shape == resistance.shape == deflection.shape) or current.ndim != 1 or len(current) < 3:
        shapes = f"{current.shape}, {resistance.shape}, {deflection.shape}"
        raise ValueError(f"current, resistance and deflection need one length of at least 3, got {shapes}")
    if not (resistance > 0.0).all():
        raise ValueError(f"resistance must be > 0 ohm, got a least of {np.min(resistance)!r}")
    outside = leaves_major_loop(current, resistance, deflection)
    with house_style():
        figure = new_figure(12.0, 7.2)
        reading = shown_signal("resistance", "ohm", resistance)
        _draw_panels(figure, current, reading, deflection, outside)
        headline(figure, _finding(title, deflection, outside), _span(current, reading))
    return figure


def _draw_panels(
    figure: Figure, current: FloatArray, reading: Shown, deflection: FloatArray, outside: Outside | None
) -> None:
    panels = figure.subplots(2, 3)
    _draw_sequence(panels[0, 0], current, "current [mA]")
    _draw_sequence(panels[1, 0], reading.values, reading.label)
    _draw_loops(panels[0, 1], current, current, reading.values, ("current [mA]", reading.label))
    panels[0, 1].legend(**ABOVE)
    scale_axis(panels[1, 0], "y", reading)
    scale_axis(panels[0, 1], "y", reading)
    if np.isfinite(deflection).any():
        _draw_loops(panels[0, 2], current, current, deflection, ("current [mA]", "deflection [µm]"))
        _draw_loops(panels[1, 1], current, reading.values, deflection, (reading.label, "deflection [µm]"))
        _draw_zoom(panels[1, 2], panels[1, 1], current, reading, deflection, outside)
    else:
        for axes in (panels[0, 2], panels[1, 1], panels[1, 2]):
            axes.set_axis_off()
    figure.align_ylabels()


def _draw_sequence(axes: Axes, values: FloatArray, label: str) -> None:
    kept = extremes(values)
    axes.plot(kept, values[kept], color=BLACK, linewidth=0.9)
    axes.set_xlim(0, len(values) - 1)
    axes.set_xlabel("sample [–]")
    axes.set_ylabel(label)


def _draw_loops(
    axes: Axes, current: FloatArray, x: FloatArray, y: FloatArray, labels: tuple[str, str]
) -> None:
    """Draw the path through all samples, coloured by its cause: a higher current or a lower one."""
    kept = path_points(current, x, y)
    current, x, y = current[kept], x[kept], y[kept]
    for sign, color, name in ((1.0, VERMILION, "heating"), (-1.0, BLUE, "cooling")):
        part = np.where(_sweeps(current, sign), y, np.nan)
        axes.plot(x, part, color=color, linewidth=1.0, marker=".", markersize=2.5, label=name)
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])


def _sweeps(current: FloatArray, sign: float) -> NDArray[np.bool_]:
    """Return the samples of sweeps in one direction, each with the turning point it starts from."""
    step = np.sign(np.diff(current, prepend=current[0] - 1.0))
    last = np.maximum.accumulate(np.where(step != 0.0, np.arange(len(step)), 0))
    along = step[last] == sign
    along[:-1] |= along[1:]
    return np.asarray(along)


def _draw_zoom(
    axes: Axes,
    whole: Axes,
    current: FloatArray,
    reading: Shown,
    deflection: FloatArray,
    outside: Outside | None,
) -> None:
    _draw_loops(axes, current, reading.values, deflection, (reading.label, "deflection [µm]"))
    scale_axis(axes, "x", reading)
    scale_axis(whole, "x", reading)
    x = np.log(reading.values)
    at = outside.sample if outside else int(np.nanargmin(np.abs(deflection - np.nanmedian(deflection))))
    left, right = np.exp(window_around(x, float(x[at]), 0.22))
    low, high = window_around(deflection, float(deflection[at]), 0.26)
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    axes.set_title("zoom into the frame: loops that are not nested" if outside else "zoom into the frame")
    frame = Rectangle(
        (left, low), right - left, high - low, fill=False, edgecolor=BLACK, linewidth=0.9, zorder=3
    )
    whole.add_patch(frame)


def _span(current: FloatArray, reading: Shown) -> str:
    low, high, unit = reading.values.min(), reading.values.max(), reading.unit.strip("[]")
    return f"{len(current)} samples, {current.min():.2f} to {current.max():.2f} mA, {low:.3g} to {high:.3g} {unit}"


def _finding(title: str, deflection: FloatArray, outside: Outside | None) -> str:
    if not np.isfinite(deflection).any():
        return f"{title}: resistance only, no external instrument"
    width = float(np.nanmax(deflection) - np.nanmin(deflection))
    nested = "minor D–R loops stay inside the major one"
    if outside:
        percent = 100.0 * outside.overshoot_um / width
        nested = (
            f"minor D–R loops leave the major one by up to {outside.overshoot_um:.2f} µm ({percent:.1f} %)"
        )
    return f"{title}: {width:.1f} µm of range, {nested}"
