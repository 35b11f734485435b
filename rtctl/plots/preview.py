"""A dataset at first sight: of every signal the first periods, the whole, and its spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.summary import RecordSummary, Summary, strongest_hz
from rtctl.output.readable_units import printed_unit
from rtctl.plots.elements.channels import spans_decades
from rtctl.plots.elements.decimation import extremes
from rtctl.plots.elements.limits import limit_axis
from rtctl.plots.elements.lines import ABOVE, draw_line, note
from rtctl.plots.elements.style import (
    BLUE,
    GREEN,
    RAIL,
    VERMILION,
    few_decades,
    headline,
    house_style,
    new_figure,
)
from rtctl.plots.frequency.density import amplitude_density

COLORS = {"fit": BLUE, "test": VERMILION, "identify": GREEN}
PERIODS, FEWEST, MOST = 10.0, 60, 2000
"""Periods of the response's strongest line at the beginning, and the limits in samples."""
DECADES = 6
"""Decades of a spectrum that are drawn below its largest value."""


class Placed(NamedTuple):
    """A record at its place on a common axis of time."""

    record: Record
    start_s: float
    first: int
    """First sample that is drawn: those before it belong to another record too."""


def preview_figure(dataset: Dataset, summary: Summary) -> Figure:
    """Return the figure of a dataset with its summary."""
    placed = _placed(dataset.records, summary.records)
    names = sorted(dataset.units, key=lambda name: name not in dataset.holds)
    with house_style():
        figure = new_figure(15.0, 1.3 + 2.35 * len(names))
        headline(figure, f"{summary.name}: {_in_words(dataset)}", _detail(summary, placed))
        axes = figure.subplots(len(names), 3, sharex="col", squeeze=False, width_ratios=(1.0, 1.45, 1.0))
        window = _window(dataset)
        for row, name in zip(axes, names, strict=True):
            _draw_first(row[0], dataset, name, window)
            _draw_whole(row[1], dataset, name, placed)
            _draw_spectrum(row[2], dataset, name, summary)
        _label(axes, dataset, placed, window)
        figure.align_ylabels(axes[:, 0])
    return figure


def _in_words(dataset: Dataset) -> str:
    count = len(dataset.records)
    seconds = sum((one.samples - one.ignore_first) * one.period_s for one in dataset.records)
    kind = (
        "a VO2 actuator"
        if dataset.plant == "vo2"
        else f"an {dataset.plant}"
        if dataset.plant == "oscillator"
        else dataset.plant
    )
    return f"{count} record{'s' if count != 1 else ''} of {kind}, {seconds:.4g} s"


def _detail(summary: Summary, placed: Sequence[Placed]) -> str:
    rates = {f"{one.rate_hz:.6g}" for one in summary.records}
    rate = f"{rates.pop()} Hz" if len(rates) == 1 else f"{len(rates)} sample rates"
    return "; ".join([rate, *_durations(placed), *_remarks(len(summary.notes))])


def _remarks(count: int) -> list[str]:
    return [f"{count} remark{'s' if count > 1 else ''}"] if count else []


def _durations(placed: Sequence[Placed]) -> list[str]:
    """Return how long the scored parts of the records of each use are, and what comes before them."""
    found = []
    for use in COLORS:
        records = [one.record for one in placed if one.record.use == use]
        if not records:
            continue
        scored_s = sum((one.samples - one.ignore_first) * one.period_s for one in records)
        before_s = sum(one.ignore_first * one.period_s for one in records)
        words = f"{use} {scored_s:.4g} s in {len(records)} record{'s' if len(records) > 1 else ''}"
        found.append(f"{words}, after {before_s:.4g} s that only lead there" if before_s > 0.0 else words)
    return found


def _placed(records: Sequence[Record], rows: Sequence[RecordSummary]) -> list[Placed]:
    """Return the records on one axis: those of one file, or group, where they are in it, files after each other."""
    found: list[Placed] = []
    base_s, end_s = 0.0, 0.0
    place: tuple[str, str | None] = "", None
    for record, row in zip(records, rows, strict=True):
        if (row.file, row.group) != place or not row.file:
            base_s, place = end_s, (row.file, row.group)
        start_s = base_s + row.first_row * record.period_s if row.file else end_s
        overlap = int(max(0.0, round((end_s - start_s) / record.period_s))) if found else 0
        found.append(Placed(record, start_s, min(overlap, record.samples - 1)))
        end_s = max(end_s, start_s + record.samples * record.period_s)
    return found


def _window(dataset: Dataset) -> float:
    """Return the seconds of the first panel."""
    record = dataset.records[0]
    output = next((name for name in record.signals if name not in dataset.holds), next(iter(record.signals)))
    line = strongest_hz(record.signals[output], record.period_s)
    samples = PERIODS / (line * record.period_s) if line else float(FEWEST)
    return record.period_s * float(np.clip(samples, min(FEWEST, record.samples), min(MOST, record.samples)))


def _draw_first(axes: Axes, dataset: Dataset, name: str, window_s: float) -> None:
    record = next((one for one in dataset.records if one.has(name)), None)
    if record is None:
        return
    count = min(int(window_s / record.period_s) + 1, record.samples)
    time_s = record.period_s * np.arange(count)
    steps = dataset.holds.get(name) == "zero"
    axes.plot(time_s, record.signals[name][:count], color=COLORS[record.use], linewidth=1.0,
              marker="." if count <= 150 else "", markersize=4.0,
              drawstyle="steps-post" if steps else "default")  # fmt: skip
    axes.set_ylabel(f"{name} [{printed_unit(dataset.units[name])}]")
    _scale(axes, dataset.units[name], record.signals[name])


def _draw_whole(axes: Axes, dataset: Dataset, name: str, placed: Sequence[Placed]) -> None:
    for one in placed:
        if one.record.has(name):
            time_s = one.start_s + one.record.period_s * np.arange(one.record.samples, dtype=np.float64)
            values = one.record.signals[name]
            draw_line(axes, time_s[one.first :], values[one.first :], COLORS[one.record.use], width=0.7)
    if len(placed) <= 24:
        for one in placed[1:]:
            axes.axvline(one.start_s + one.first * one.record.period_s, color=RAIL, linewidth=0.8, zorder=0.5)
    values = np.concatenate([o.record.signals[name] for o in placed if o.record.has(name)])
    if not _scale(axes, dataset.units[name], values):
        limit_axis(axes, values)


def _draw_spectrum(axes: Axes, dataset: Dataset, name: str, summary: Summary) -> None:
    drawn = False
    for use, color in COLORS.items():
        for record in _with_spectra(
            [one for one in dataset.records if one.use == use and one.has(name)], name
        ):
            values = record.signals[name][record.ignore_first :]
            frequency, amplitude = amplitude_density(values, record.period_s)
            kept = extremes(np.log(np.maximum(amplitude, 1e-300)))
            axes.plot(frequency[kept], amplitude[kept], color=color, linewidth=0.9)
            drawn = True
    if not drawn:
        note(axes, "nothing varies, or too few samples: there is no spectrum")
        return
    axes.set(
        xscale="log", yscale="log", ylabel=f"amplitude density [{printed_unit(dataset.units[name])}/√Hz]"
    )
    heights = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    axes.set_ylim(max(float(heights[heights > 0.0].min()), 10.0**-DECADES * float(heights.max())) / 1.5)
    line_hz = {one.name: one.strongest_hz for one in summary.signals}[name]
    if line_hz is not None:
        axes.axvline(line_hz, color=RAIL, linewidth=1.0, zorder=0.5)
        drives = any(np.ptp(one.signals[source]) for one in dataset.records for source in dataset.holds)
        also = ", where the drive counts too" if drives and name not in dataset.holds else ""
        axes.set_title(f"largest at {line_hz:.4g} Hz{also}", loc="right", fontsize=9.0)


def _with_spectra(records: Sequence[Record], name: str) -> list[Record]:
    """Return the longest record in which a signal varies and, where that is another one, the strongest."""
    varying = [
        one for one in records if one.samples >= 32 and np.ptp(one.signals[name][one.ignore_first :]) > 0.0
    ]
    if not varying:
        return []
    longest = max(varying, key=lambda one: one.samples)
    strongest = max(varying, key=lambda one: float(np.std(one.signals[name][one.ignore_first :])))
    return [longest] if strongest is longest else [longest, strongest]


def _scale(axes: Axes, unit: str, values: FloatArray) -> bool:
    """Make the axis of a resistance that spans decades logarithmic; return whether it is."""
    logarithmic = unit == "ohm" and spans_decades(values)
    if logarithmic:
        axes.set_yscale("log")
        few_decades(axes.yaxis)
    return logarithmic


def _label(axes: np.ndarray[tuple[int, ...], np.dtype[np.object_]], dataset: Dataset, placed: Sequence[Placed],
           window_s: float) -> None:  # fmt: skip
    uses = [use for use in COLORS if any(one.use == use for one in dataset.records)]
    names: Mapping[str, str] = {"fit": "for the fit", "test": "for the test", "identify": "for the loops"}
    for use in uses:
        axes[0][1].plot([], [], color=COLORS[use], label=names[use])
    axes[0][1].legend(**ABOVE)
    files = {one.file for one in dataset.records}
    several = (
        "files" if len(files) > 1 else "groups" if len({one.group for one in dataset.records}) > 1 else ""
    )
    first = dataset.records[0].name
    axes[-1][0].set_xlabel(f"time [s]: the beginning of {first}")
    axes[-1][0].set_xlim(0.0, window_s)
    axes[-1][1].set_xlabel(f"time [s], {several} one after the other" if several else "time [s]")
    end_s = max(one.start_s + one.record.samples * one.record.period_s for one in placed)
    axes[-1][1].set_xlim(min(one.start_s for one in placed), end_s)
    axes[-1][2].set_xlabel("frequency [Hz]")
