"""A model before and after its extension beside a measurement: worst section, spectra, state plane."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.output.readable_units import printed_unit, readable_unit
from rtctl.plots.elements.before_after import BeforeAfter
from rtctl.plots.elements.channels import fitting_unit
from rtctl.plots.elements.decimation import extremes
from rtctl.plots.elements.limits import limit_axis
from rtctl.plots.elements.lines import ABOVE, draw_line, tick_frequencies
from rtctl.plots.elements.readings import DrawnError, drawn_error, drawn_reading
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    RAIL,
    VERMILION,
    house_style,
    new_figure,
)
from rtctl.plots.frequency.density import amplitude_density

STRETCH_PERIODS = 12.0
MOST_CELLS, FEWEST_CELLS = 28, 10
"""Cells of the state plane along each side, as many as the samples fill."""
SAMPLES_A_CELL = 20
"""Samples that a cell has on average where there are few."""
OUTERMOST = 0.002
"""Share of the samples on either side beyond the outermost cells."""
LEAST_COUNT = 5
"""Samples below which the mean of a cell is not drawn: it would be noise."""


def worst_stretch(error: FloatArray, length: int) -> slice:
    """Return `length` samples with the largest RMS of `error` (n,)."""
    length = min(length, len(error))
    power = np.cumsum(np.append(0.0, error**2))
    first = int(np.argmax(power[length:] - power[:-length]))
    return slice(first, first + length)


def stretch_figure(shown: BeforeAfter, noise_rms: float, *, extended: bool) -> Figure:
    """Draw measured and simulated where the old model is worst, its residual, and the residual of the whole record."""
    before, after = shown.errors
    length = max(24, round(STRETCH_PERIODS * 2.0 * np.pi / shown.rate / shown.period_s))
    window, all_of_it = worst_stretch(before, length), slice(0, len(before))
    scale, clock = drawn_error(shown.unit, before), readable_unit(float(shown.time_s[-1]), "s")
    time = clock.factor * shown.time_s
    with house_style():
        figure = new_figure(10.0, 6.6)
        motion, error, whole = figure.subplots(3, 1, height_ratios=(1.5, 1.0, 1.0))
        _draw_motion(motion, time, shown, window, extended=extended)
        curves = [(before, VERMILION, "error of the nominal model")]
        curves += [(after, BLUE, "of the extended model")] if extended else []
        for values, color, label in curves:
            drawn = scale.of(shown.with_gaps(values))
            error.plot(time[window], drawn[window], color=color, label=label)
            for k, piece in enumerate(shown.pieces):
                draw_line(whole, time[piece], drawn[piece], color, "" if k else label, 0.7)
        for axes in (error, whole):
            _draw_noise(axes, scale, noise_rms)
        limit_axis(whole, *(scale.of(values) for values, *_ in curves))
        for axes, part in ((motion, window), (error, window), (whole, all_of_it)):
            starts = [start for start in shown.starts[1:] if part.start < start < part.stop]
            for start in starts:  # where free runs begin anew
                axes.axvline(time[start], color=RAIL, linewidth=0.8, zorder=0.5)
        pieces = f", in {len(shown.starts)} pieces" if len(shown.starts) > 1 else ""
        shaded = ""
        if window != all_of_it:
            whole.axvspan(time[window][0], time[window][-1], color=GREEN, alpha=0.15, linewidth=0.0)
            shaded = "; the stretch above is shaded"
        error.set_xlabel(f"time [{clock.unit}]: record {shown.record}, where the nominal model is worst")
        whole.set_xlabel(f"time [{clock.unit}]: all of the record{pieces}{shaded}")
        return figure


def _draw_motion(axes: Axes, time: FloatArray, shown: BeforeAfter, window: slice, *, extended: bool) -> None:
    """Draw the simulations as wide lines and the measurement over them as a thin one: neither hides the other."""
    reading = drawn_reading(shown.output, shown.unit, shown.measured)
    curves = [(shown.measured, BLACK, "measured", 0.9, 3.0)]
    curves += [(shown.before, VERMILION, "simulated by the nominal model, re-fitted", 2.6, 2.0)]
    curves += [(shown.after, BLUE, "by the extended model", 1.8, 2.5)] if extended else []
    for values, color, label, width, order in curves:
        drawn = reading.of(shown.with_gaps(values))[window]
        axes.plot(time[window], drawn, color=color, label=label, linewidth=width, zorder=order)
    reading.label(axes)
    axes.legend(**ABOVE)


def _draw_noise(axes: Axes, scale: DrawnError, noise_rms: float) -> None:
    band = 2.0 * scale.factor * noise_rms
    axes.axhspan(-band, band, color=GREY, alpha=0.25, linewidth=0.0, label="noise, ±2σ")
    axes.set_ylabel(scale.label)
    axes.legend(**ABOVE)


def spectrum_figure(
    shown: BeforeAfter, noise_frequency_hz: FloatArray, noise_density: FloatArray, *, extended: bool
) -> Figure:
    """Draw amplitude densities of the reading, the errors and the estimated noise."""
    before, after = shown.errors
    lines = [(shown.measured, BLACK, "measured"), (before, VERMILION, "error of the nominal model")]
    if extended:
        lines.append((after, BLUE, "error of the extended model"))
    scale = drawn_error(shown.unit, before)
    with house_style():
        figure = new_figure(10.0, 4.2)
        axes = figure.subplots()
        lowest = np.inf
        for values, color, label in lines:
            frequency, amplitude = _density(shown, scale.factor * values)
            if not amplitude.max() > 0.0:
                continue
            lowest = min(lowest, float(np.quantile(amplitude, 0.02)))
            kept = extremes(np.log(np.maximum(amplitude, 1e-300)))
            axes.plot(frequency[kept], amplitude[kept], color=color, label=label)
        noise = scale.factor * noise_density
        axes.plot(noise_frequency_hz[1:], noise[1:], color=GREY, linewidth=2.2, label="noise, as estimated")
        axes.set(xscale="log", yscale="log", xlabel="frequency [Hz]")
        axes.set_ylim(bottom=0.3 * min(lowest, float(noise[1:].min())))
        axes.set_xlim(float(frequency[0]), 0.5 / shown.period_s)
        tick_frequencies(axes)
        axes.set_ylabel(f"amplitude density [{scale.unit}/√Hz]")
        axes.legend(**ABOVE | {"ncols": 4})
        return figure


def _density(shown: BeforeAfter, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and amplitude density of the longest pieces of a record, powers averaged."""
    longest = max(one.stop - one.start for one in shown.pieces)
    several = len(shown.pieces) > 1  # their average takes the place of that of segments
    found = [
        amplitude_density(values[one], shown.period_s, segment=longest if several else None)
        for one in shown.pieces
        if one.stop - one.start == longest
    ]
    power = np.mean([amplitude**2 for _, amplitude in found], axis=0)
    return found[0][0], np.sqrt(power)


def plane_figure(records: Sequence[BeforeAfter], *, extended: bool) -> Figure:
    """Draw the mean error of all `records` in each cell of the state plane, before and after, on one scale."""
    before, after = (np.concatenate([one.errors[k] for one in records]) for k in (0, 1))
    output, unit = records[0].output, records[0].unit
    position = np.nan_to_num(np.concatenate([one.after for one in records]))
    speed = np.nan_to_num(np.concatenate([one.output_rate for one in records]))
    across, up = fitting_unit(unit, position), fitting_unit(rate_unit(unit), speed)
    panels = [(before, "nominal model, re-fitted")] + ([(after, "extended model")] if extended else [])
    scale = drawn_error(unit, before)
    with house_style():
        figure = new_figure(10.0 if extended else 5.6, 4.2)
        row = np.atleast_1d(figure.subplots(1, len(panels), sharex=True, sharey=True))
        edges = _edges(across.factor * position), _edges(up.factor * speed)
        maps = [
            cell_means((across.factor * position, up.factor * speed), scale.factor * error, edges)
            for error, _ in panels
        ]
        limit = float(np.nanquantile(np.abs(maps[0]), 0.98)) if np.isfinite(maps[0]).any() else 0.0
        limit = limit or 1.0
        for axes, means, (_, title) in zip(row, maps, panels, strict=True):
            drawn = axes.pcolormesh(*edges, means.T, cmap="PuOr", vmin=-limit, vmax=limit, rasterized=True)
            axes.set_title(title)
            axes.set_xlabel(f"{output} [{printed_unit(across.unit)}]")
            _fit_to_cells(axes, maps[0], edges)
            _centre_grid(axes)
        row[0].set_ylabel(f"rate of the {output} [{printed_unit(up.unit)}]")
        bar = figure.colorbar(drawn, ax=row.tolist(), extend="both")
        bar.set_label(f"mean error [{scale.unit}]")
        return figure


def rate_unit(unit: str) -> str:
    """Return the unit of the rate of what is in `unit`: mm/s of mm, mm/s^2 of mm/s."""
    found = re.fullmatch(r"(.*/s)(?:\^(\d))?", unit)
    return f"{unit}/s" if found is None else f"{found[1]}^{int(found[2] or 1) + 1}"


def _fit_to_cells(axes: Axes, means: FloatArray, edges: tuple[FloatArray, FloatArray]) -> None:
    """Leave out what lies beyond the outermost cells that are drawn."""
    filled = np.isfinite(means)
    if filled.any():
        across, up = (np.flatnonzero(filled.any(axis=other)) for other in (1, 0))
        axes.set_xlim(edges[0][across[0]], edges[0][across[-1] + 1])
        axes.set_ylim(edges[1][up[0]], edges[1][up[-1] + 1])


def _centre_grid(axes: Axes) -> None:
    """Draw zero of both axes where the motion goes there: a beam in one of its wells does not."""
    limits = axes.get_xlim(), axes.get_ylim()
    axes.grid(False)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.axvline(0.0, color=GREY, linewidth=0.6)
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _edges(along: FloatArray) -> FloatArray:
    """Return the edges of the cells along one axis: fewer cells where there are few samples."""
    low, high = np.quantile(along, [OUTERMOST, 1.0 - OUTERMOST]).tolist()
    if not high > low:
        low, high = low - 1.0, high + 1.0
    count = int(np.clip(np.sqrt(len(along) / SAMPLES_A_CELL), FEWEST_CELLS, MOST_CELLS))
    return np.linspace(low, high, count + 1)


def cell_means(
    at: tuple[FloatArray, FloatArray], values: FloatArray, edges: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Return the mean of `values` (n,) in each cell, NaN where fewer than `LEAST_COUNT` lie in it."""
    count = np.histogram2d(*at, bins=edges)[0]
    total = np.histogram2d(*at, bins=edges, weights=values)[0]
    with np.errstate(invalid="ignore"):
        means: FloatArray = total / np.where(count >= LEAST_COUNT, count, np.nan)
    return means
