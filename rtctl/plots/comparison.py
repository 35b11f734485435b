"""A simulation beside its measurement: in time, around its worst moment, and in frequency, with the error's share.

The error's spectrum says what is missing (a harmonic, a resonance, a slow drift), the one of what does not repeat
says how much of it a model could ever explain.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.measured.dataset import paired
from rtctl.output.readable_units import printed_unit, readable
from rtctl.plots.elements.channels import fitting_unit
from rtctl.plots.elements.decimation import extremes
from rtctl.plots.elements.limits import note_beyond, robust_limits
from rtctl.plots.elements.lines import ABOVE, draw_line, note, tick_frequencies
from rtctl.plots.elements.readings import drawn_error, drawn_reading
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    VERMILION,
    headline,
    house_style,
    new_figure,
    save_png,
)
from rtctl.plots.frequency.density import amplitude_density
from rtctl.plots.frequency.sweep import compared_curves, sweep_figure

BEYOND = 1.5
"""Widths of the measured range that a simulation may lie beyond it on the axis."""
MOST_SIGNALS = 1e3
"""Multiple of the largest reading above which an error means divergence and is not drawn."""
PERIODS_SHOWN = 12.0
"""Periods of the strongest line shown around the worst moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """One output of one record, measured and simulated."""

    title: str
    output: str
    unit: str
    time_s: FloatArray
    """Time (n,) [s], uniform."""
    measured: FloatArray
    simulated: FloatArray
    """Simulated output (n,); NaN from where the simulation diverged."""
    ignore_first: int = 0
    noise: FloatArray | None = None
    """Part that does not repeat (n,), where the input was repeated."""
    frequency_hz: FloatArray | None = None
    """Frequencies (n / 2,) of a sweep, whose outputs have two samples a row; None: it is a record in time."""

    @property
    def error(self) -> FloatArray:
        """Simulated minus measured (n,)."""
        return self.simulated - self.measured

    @property
    def scored(self) -> slice:
        """Samples that count: after `ignore_first`, before a divergence or values too large to draw."""
        beyond = (
            MOST_SIGNALS * float(np.abs(self.measured).max()) or np.inf
        )  # nothing moved: nothing is too large
        with np.errstate(invalid="ignore"):
            bad = np.flatnonzero(~(np.abs(self.error[self.ignore_first :]) <= beyond))
        end = len(self.error) if not len(bad) else self.ignore_first + int(bad[0])
        return slice(self.ignore_first, end)


def plot_comparison(path: Path, compared: Compared) -> None:
    """Write the figure as a PNG file."""
    save_png(comparison_figure(compared), path)


def comparison_figure(compared: Compared) -> Figure:
    """Return the figure that `plot_comparison` writes."""
    if compared.frequency_hz is not None:
        simulated = [("the model", BLUE, paired(compared.simulated))]
        curves = compared_curves(compared.frequency_hz, paired(compared.measured), simulated)
        noise = 0.0 if compared.noise is None else _rms(compared.noise)
        return sweep_figure(*_headline(compared), compared.output, compared.unit, curves, noise)
    with house_style():
        figure = new_figure(14.0, 8.4)
        headline(figure, *_headline(compared))
        left, right = np.asarray(figure.subfigures(1, 2, width_ratios=(1.35, 1.0))).tolist()
        whole, error, moment = left.subplots(3, 1, height_ratios=(1.2, 0.9, 1.2))
        _draw_whole(whole, compared)
        _draw_error(error, compared)
        error.sharex(whole)
        _draw_moment(moment, compared)
        density, share = right.subplots(2, 1, height_ratios=(2.2, 1.0), sharex=True)
        _draw_densities(density, share, compared)
        return figure


def _headline(compared: Compared) -> tuple[str, str]:
    scored = compared.scored
    scored_signal = compared.measured[compared.ignore_first :]
    signal = _rms(scored_signal) if compared.frequency_hz is not None else variation(scored_signal)
    if scored.stop < len(compared.error):
        when = compared.time_s[scored.stop] - compared.time_s[0]
        return (
            f"{compared.title}: the simulation diverged at {when:.4g} s",
            f"{compared.output} varies by {in_words(signal, compared.unit)} RMS; what follows is before the divergence",
        )
    error = compared.error[scored]
    share = _percent(_rms(error), signal)
    finding = f"{compared.title}: simulated {compared.output} is off by {share} of its variation"
    largest = float(np.abs(error).max())
    detail = f"error RMS {in_words(_rms(error), compared.unit)}, largest {in_words(largest, compared.unit)}"
    detail += f"; the signal varies by {in_words(signal, compared.unit)} RMS about its mean"
    if compared.noise is not None:
        floor = _rms(compared.noise[compared.ignore_first :])
        detail += f"; what does not repeat {in_words(floor, compared.unit)}"
    return finding, detail


def in_words(value: float, unit: str, digits: int = 4) -> str:
    """Return a value in the unit that fits, as pictures print it."""
    return printed_unit(readable(value, unit, digits))


def _percent(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.3g} %" if whole > 0.0 else "an unknown share"


def variation(values: FloatArray) -> float:
    """Return the RMS of `values` (n,) about their mean."""
    return float(np.std(values)) if len(values) else 0.0


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def _draw_whole(axes: Axes, compared: Compared) -> None:
    reading = drawn_reading(compared.output, compared.unit, compared.measured)
    draw_line(axes, compared.time_s, reading.of(compared.simulated), BLUE, "simulated", 2.0)
    draw_line(axes, compared.time_s, reading.of(compared.measured), BLACK, "measured", 0.8)
    low, high, _ = robust_limits(reading.of(compared.measured))
    if not reading.is_logarithmic:
        wide = high - low  # a diverging model must not flatten the data
        shown = axes.get_ylim()
        axes.set_ylim(max(shown[0], low - BEYOND * wide), min(shown[1], high + BEYOND * wide))
    reading.label(axes)
    axes.legend(**ABOVE)


def _draw_error(axes: Axes, compared: Compared) -> None:
    error = compared.error[compared.scored]
    scale = drawn_error(compared.unit, error)
    draw_line(axes, compared.time_s, scale.of(compared.error), VERMILION, "simulated − measured", 0.8)
    if len(error):
        low, high, beyond = robust_limits(scale.of(error))
        limit = max(abs(low), abs(high)) or 1.0
        axes.set_ylim(-limit, limit)
        if beyond:
            note_beyond(axes, beyond)
    first = compared.ignore_first
    if first:
        axes.axvspan(
            compared.time_s[0],
            compared.time_s[first],
            color=GREY,
            alpha=0.25,
            linewidth=0.0,
            label="not scored",
        )
    axes.set_ylabel(scale.label)
    axes.set_xlabel("time [s]")
    axes.legend(**ABOVE)


def _draw_moment(axes: Axes, compared: Compared) -> None:
    """Draw some periods around the largest error, where the two can be distinguished."""
    window = _worst_window(compared)
    time, marker = compared.time_s[window], "." if window.stop - window.start < 150 else ""
    reading = drawn_reading(compared.output, compared.unit, compared.measured)
    curves = [(compared.simulated, BLUE, "simulated", 2.4), (compared.measured, BLACK, "measured", 0.9)]
    if not reading.is_logarithmic and _reaches_zero(compared.measured[window]):
        curves.append((compared.error, VERMILION, "error", 1.0))
    for values, color, label, width in curves:
        drawn = reading.of(values[window])
        axes.plot(time, drawn, color=color, linewidth=width, marker=marker, markersize=4.0, label=label)
    reading.label(axes)
    axes.set_xlabel("time [s]: around the largest error")
    axes.legend(**ABOVE)


def _reaches_zero(values: FloatArray) -> bool:
    """Return whether zero is so near to `values` that an axis with both shows how they vary: not of a temperature."""
    low, high = float(values.min()), float(values.max())
    return max(low, -high, 0.0) <= BEYOND * (high - low)


def _worst_window(compared: Compared) -> slice:
    scored, count = compared.scored, len(compared.measured)
    error = np.abs(compared.error[scored])
    centre = scored.start + (int(error.argmax()) if len(error) else 0)
    period = _strongest_period(compared.measured[compared.ignore_first :])
    half = int(np.clip(0.5 * PERIODS_SHOWN * period, 20, max(20, count // 20)))
    first = min(max(centre - half, 0), max(count - 2 * half, 0))
    return slice(first, min(first + 2 * half, count))


def _strongest_period(values: FloatArray) -> float:
    """Return the samples in a period of the strongest line of `values`."""
    values = values[: 1 << 18]
    size = np.abs(np.fft.rfft(values - values.mean()))
    return len(values) / max(int(size.argmax()), 1)


def _draw_densities(density: Axes, share: Axes, compared: Compared) -> None:
    scored, scaled = compared.scored, fitting_unit(compared.unit, compared.measured)
    lines = [
        (compared.simulated[scored], BLUE, "simulated", 2.0),
        (compared.measured[scored], BLACK, "measured", 0.9),
        (compared.error[scored], VERMILION, "error", 1.0),
    ]
    if compared.noise is not None:
        lines.append((compared.noise[scored], SKY, "does not repeat (noise floor)", 1.0))
    period_s = float(compared.time_s[1] - compared.time_s[0])
    if scored.stop - scored.start < 32:
        note(density, "too few samples before the divergence for a spectrum")
        return
    if not any(np.ptp(values) for values, *_ in lines):
        note(density, "nothing varies: there is no spectrum")
        return
    for values, color, label, width in lines:
        frequency, amplitude = amplitude_density(scaled.factor * values, period_s)
        kept = extremes(np.log(np.maximum(amplitude, 1e-300)))
        density.plot(frequency[kept], amplitude[kept], color=color, linewidth=width, label=label)
    density.set(xscale="log", yscale="log", ylabel=f"amplitude density [{printed_unit(scaled.unit)}/√Hz]")
    density.set_ylim(bottom=_lowest_shown(density))
    tick_frequencies(density)
    density.legend(**ABOVE | {"ncols": 4})
    error = compared.error[scored]
    _draw_share(share, error, period_s)
    mean, size = float(error.mean()), _rms(error)
    if size > 0.0:
        part = f"{100.0 * (mean / size) ** 2:.2g} % of its power"
        share.set_title(f"mean error {in_words(mean, compared.unit, 3)}: {part}", loc="right", fontsize=9.0)


def _lowest_shown(axes: Axes) -> float:
    """Limit the axis to six decades below the largest value: a filtered or computed zero carries no information."""
    heights = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    return float(max(heights[heights > 0.0].min(initial=np.inf), 1e-6 * heights.max()))


def _draw_share(axes: Axes, error: FloatArray, period_s: float) -> None:
    """Draw how much of the error's power lies below each frequency, the mean included."""
    frequency, amplitude = amplitude_density(error, period_s, remove_mean=False)
    power = np.cumsum(amplitude**2)
    if power[-1] > 0.0:
        kept = extremes(power)
        axes.step(frequency[kept], 100.0 * power[kept] / power[-1], color=VERMILION, where="mid")
    axes.set(ylim=(0.0, 103.0), ylabel="share of error power\nbelow [%]", xlabel="frequency [Hz]")
    axes.set_xlim(frequency[1], frequency[-1])
