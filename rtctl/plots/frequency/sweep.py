"""Sweeps of frequencies: amplitude and phase of what was measured and simulated, and how far they are apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.measured.dataset import Dataset, Record
from rtctl.output.readable_units import printed_unit
from rtctl.plots.elements.channels import fitting_unit
from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.elements.style import BLACK, BLUE, GREEN, GREY, VERMILION, headline, house_style, new_figure

USES = {"fit": BLUE, "test": VERMILION, "identify": GREEN}
SMALL = 1e-3
"""Share of the largest amplitude below which a phase is not drawn: it is noise."""


class Curve(NamedTuple):
    """Complex amplitudes (n,) over frequencies (n,) [Hz]."""

    label: str
    frequency_hz: FloatArray
    amplitude: ComplexArray
    color: str
    line: str = "-"
    marker: str = ""


def sweep_figure(
    title: str, detail: str, quantity: str, unit: str, curves: Sequence[Curve], noise: float = 0.0
) -> Figure:
    """Return the figure of one sweep: the first curve is measured, the others are simulated at its frequencies.

    Args:
        title: Headline.
        detail: Line below it.
        quantity: Name of the response.
        unit: Its unit.
        curves: What is drawn.
        noise: RMS of the noise of a reading [unit]; 0: it is not known.
    """
    with house_style():
        figure = new_figure(10.0, 8.4)
        headline(figure, title, detail)
        amplitude, phase, error = figure.subplots(3, 1, height_ratios=(1.4, 1.0, 1.0), sharex=True)
        _draw_response(amplitude, phase, quantity, unit, curves)
        measured, *simulated = curves
        scale = fitting_unit(unit, *(np.abs(one.amplitude - measured.amplitude) for one in simulated))
        for one in simulated:
            apart = scale.factor * np.abs(one.amplitude - measured.amplitude)
            error.plot(one.frequency_hz, apart, color=one.color, marker=".", label=f"error of {one.label}")
        if noise > 0.0:
            error.axhline(scale.factor * np.sqrt(2.0) * noise, color=GREY, linestyle="--", label="noise")
        error.set_ylim(bottom=0.0)
        error.set_ylabel(f"|simulated - measured| [{printed_unit(scale.unit)}]")
        error.legend(**ABOVE)
        error.set_xlabel(f"frequency [Hz], {direction(measured.frequency_hz)}")
        return figure


def sweeps_figure(dataset: Dataset, title: str) -> Figure:
    """Return the figure of all sweeps of a dataset: amplitude and phase, falling ones dashed."""
    (output,) = (name for name in dataset.units if name not in dataset.holds)
    unit = printed_unit(dataset.units["drive"])
    curves = [_of_record(record, output, unit) for record in dataset.records if record.has(output)]
    with house_style():
        figure = new_figure(11.0, 7.4)
        headline(
            figure,
            title,
            "phase of the response against the drive, below 0 where it lags; dashed: falling sweep",
        )
        amplitude, phase = figure.subplots(2, 1, height_ratios=(1.5, 1.0), sharex=True)
        _draw_response(amplitude, phase, output, dataset.units[output], curves)
        phase.set_xlabel("frequency [Hz]")
        return figure


def direction(frequency_hz: FloatArray) -> str:
    """Return which way a sweep went."""
    return "rising" if frequency_hz[-1] > frequency_hz[0] else "falling"


def _of_record(record: Record, output: str, drive_unit: str) -> Curve:
    frequency = record.frequencies_hz
    drive = record.signals["drive"]
    level = f", drive {drive[0]:.4g} {drive_unit}" if not np.ptp(drive) else ""
    label = f"{record.name} ({record.use}{level}, {direction(frequency)})"
    line = "-" if frequency[-1] > frequency[0] else "--"
    return Curve(label, frequency, record.complex_amplitudes(output), USES[record.use], line, ".")


def _draw_response(amplitude: Axes, phase: Axes, quantity: str, unit: str, curves: Sequence[Curve]) -> None:
    largest = max(float(np.abs(one.amplitude).max()) for one in curves)
    scale = fitting_unit(unit, np.array([largest]))
    for one in curves:
        size = np.abs(one.amplitude)
        look: dict[str, Any] = {
            "color": one.color,
            "linestyle": one.line,
            "marker": one.marker,
            "markersize": 4.0,
            "linewidth": 1.0,
        }
        amplitude.plot(one.frequency_hz, scale.factor * size, label=one.label, **look)
        shown = np.where(size > SMALL * largest, _degrees(one.amplitude), np.nan)
        phase.plot(one.frequency_hz, shown, **look)
    amplitude.set_ylim(bottom=0.0)
    amplitude.set_ylabel(f"amplitude of {quantity} [{printed_unit(scale.unit)}]")
    amplitude.legend(**{**ABOVE, "ncols": 2 if len(curves) > 3 else 3})
    phase.set_ylabel("phase [deg]")


def _degrees(amplitudes: ComplexArray) -> FloatArray:
    """Return phases (n,) [deg] from -270 to 90, in which a resonance's fall from 0 to -180 has no jump."""
    angle = np.rad2deg(np.angle(amplitudes))
    return np.where(angle > 90.0, angle - 360.0, angle)


def compared_curves(
    frequency_hz: FloatArray, measured: ComplexArray, simulated: Sequence[tuple[str, str, ComplexArray]]
) -> list[Curve]:
    """Return the curves of `sweep_figure` from labels, colours and complex amplitudes (n,) of simulations."""
    first = Curve("measured", frequency_hz, measured, BLACK, "", "o")
    return [first, *(Curve(label, frequency_hz, values, color) for label, color, values in simulated)]
