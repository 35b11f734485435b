"""A model before and after its extension beside a measurement: worst section, spectra, state plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.plots.comparison import amplitude_density
from rtctl.plots.elements.channels import written
from rtctl.plots.elements.decimation import extremes
from rtctl.plots.elements.lines import ABOVE, draw_line
from rtctl.plots.elements.style import BLACK, BLUE, GREEN, GREY, VERMILION, house_style, new_figure

STRETCH_PERIODS = 12.0
CELLS = 28
"""Cells of the state plane along each side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BeforeAfter:
    """One record, scored samples (n,), in the data's units; NaN from where a model diverged."""

    record: str
    output: str
    unit: str
    time_s: FloatArray
    measured: FloatArray
    before: FloatArray
    after: FloatArray
    velocity: FloatArray
    """Velocity of `after` [unit/s]."""
    rate: float
    """Dominant angular frequency [1/s]."""

    @property
    def errors(self) -> tuple[FloatArray, FloatArray]:
        """Return simulated minus measured, before and after; 0 where a model diverged."""
        return np.nan_to_num(self.before - self.measured), np.nan_to_num(self.after - self.measured)


def worst_stretch(error: FloatArray, length: int) -> slice:
    """Return `length` samples with the largest RMS of `error` (n,)."""
    length = min(length, len(error))
    power = np.cumsum(np.append(0.0, error**2))
    first = int(np.argmax(power[length:] - power[:-length]))
    return slice(first, first + length)


def stretch_figure(shown: BeforeAfter, noise_rms: float, *, extended: bool) -> Figure:
    """Draw measured and simulated where the old model is worst, its residual, and the residual of the whole record."""
    period_s = float(shown.time_s[1] - shown.time_s[0])
    before, after = shown.errors
    window = worst_stretch(before, max(24, round(STRETCH_PERIODS * 2.0 * np.pi / shown.rate / period_s)))
    with house_style():
        figure = new_figure(10.0, 6.6)
        motion, error, whole = figure.subplots(3, 1, height_ratios=(1.5, 1.0, 1.0))
        time, unit = shown.time_s[window], written(shown.unit)
        motion.plot(time, shown.measured[window], color=BLACK, label="measured", linewidth=1.6)
        motion.plot(
            time, shown.before[window], color=VERMILION, label="simulated by today's model, re-fitted"
        )
        error.plot(time, before[window], color=VERMILION, label="error of today's model")
        draw_line(whole, shown.time_s, before, VERMILION, "error of today's model", 0.7)
        if extended:
            motion.plot(time, shown.after[window], color=BLUE, label="by the extended model", linestyle="--")
            error.plot(time, after[window], color=BLUE, label="of the extended model")
            draw_line(whole, shown.time_s, after, BLUE, "of the extended model", 0.7)
        for axes in (error, whole):
            axes.axhspan(
                -2.0 * noise_rms, 2.0 * noise_rms, color=GREY, alpha=0.25, linewidth=0.0, label="noise, ±2σ"
            )
            axes.set_ylabel(f"error [{unit}]")
            axes.legend(**ABOVE)
        whole.axvspan(time[0], time[-1], color=GREEN, alpha=0.15, linewidth=0.0)
        motion.set_ylabel(f"{shown.output.replace('_', ' ')} [{unit}]")
        motion.legend(**ABOVE)
        error.set_xlabel(f"time [s]: record {shown.record}, where today's model is worst")
        whole.set_xlabel("time [s]: all of the record; the stretch above is shaded")
        return figure


def spectrum_figure(
    shown: BeforeAfter, noise_frequency_hz: FloatArray, noise_density: FloatArray, *, extended: bool
) -> Figure:
    """Draw amplitude densities of the reading, the errors and the estimated noise."""
    period_s = float(shown.time_s[1] - shown.time_s[0])
    before, after = shown.errors
    lines = [(shown.measured, BLACK, "measured"), (before, VERMILION, "error of today's model")]
    if extended:
        lines.append((after, BLUE, "error of the extended model"))
    with house_style():
        figure = new_figure(10.0, 4.2)
        axes = figure.subplots()
        lowest = np.inf
        for values, color, label in lines:
            frequency, amplitude = amplitude_density(values, period_s)
            if not amplitude.max() > 0.0:
                continue
            lowest = min(lowest, float(np.quantile(amplitude, 0.02)))
            kept = extremes(np.log(np.maximum(amplitude, 1e-300)))
            axes.plot(frequency[kept], amplitude[kept], color=color, label=label)
        axes.plot(
            noise_frequency_hz[1:], noise_density[1:], color=GREY, linewidth=2.2, label="noise, as estimated"
        )
        axes.set(xscale="log", yscale="log", xlabel="frequency [Hz]")
        axes.set_ylim(bottom=0.3 * min(lowest, float(noise_density[1:].min())))
        axes.set_xlim(float(frequency[0]), 0.5 / period_s)
        axes.set_ylabel(f"amplitude density [{written(shown.unit)}/√Hz]")
        axes.legend(**ABOVE | {"ncols": 4})
        return figure


def plane_figure(records: Sequence[BeforeAfter], *, extended: bool) -> Figure:
    """Draw the mean error of all `records` in each cell of the state plane, before and after, on one scale."""
    before, after = (np.concatenate([one.errors[k] for one in records]) for k in (0, 1))
    position = np.nan_to_num(np.concatenate([one.after for one in records]))
    speed = np.nan_to_num(np.concatenate([one.velocity for one in records]))
    panels = [(before, "today's model, re-fitted")] + ([(after, "extended model")] if extended else [])
    unit = written(records[0].unit)
    with house_style():
        figure = new_figure(10.0 if extended else 5.6, 4.2)
        row = np.atleast_1d(figure.subplots(1, len(panels), sharex=True, sharey=True))
        maps = [_cell_means(position, speed, error) for error, _ in panels]
        limit = float(np.nanquantile(np.abs(maps[0][0]), 0.98)) or 1.0
        for axes, (means, x, y), (_, title) in zip(row, maps, panels, strict=True):
            drawn = axes.pcolormesh(x, y, means.T, cmap="PuOr", vmin=-limit, vmax=limit, rasterized=True)
            axes.set_title(title)
            axes.set_xlabel(f"{records[0].output} [{unit}]")
            _centre_grid(axes)
        row[0].set_ylabel(f"rate of the {records[0].output} [{unit}/s]")
        bar = figure.colorbar(drawn, ax=row.tolist(), extend="both")
        bar.set_label(f"mean error [{unit}]")
        return figure


def _centre_grid(axes: Axes) -> None:
    """Draw zero of both axes where the motion goes there: a beam in one of its wells does not."""
    limits = axes.get_xlim(), axes.get_ylim()
    axes.grid(False)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.axvline(0.0, color=GREY, linewidth=0.6)
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _cell_means(
    x: FloatArray, y: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (CELLS, CELLS) means, NaN for empty cells, and the edges of both axes."""
    edges = []
    for along in (x, y):
        low, high = np.quantile(along, [0.002, 0.998]).tolist()
        edges.append(np.linspace(low, high, CELLS + 1) if high > low else np.linspace(-1.0, 1.0, CELLS + 1))
    count = np.histogram2d(x, y, bins=edges)[0]
    total = np.histogram2d(x, y, bins=edges, weights=values)[0]
    with np.errstate(invalid="ignore"):
        return total / np.where(count > 0, count, np.nan), edges[0], edges[1]
