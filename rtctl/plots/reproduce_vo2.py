"""Pictures of the VO2 paper's study: its figures on our devices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.output.readable_units import printed_unit
from rtctl.plots.elements.channels import fitting_unit
from rtctl.plots.elements.lines import ABOVE, draw_line
from rtctl.plots.elements.style import BLACK, CYCLE, RAIL, few_decades, headline, house_style, new_figure


class Loops(Protocol):
    """Samples (n,) of a path."""

    @property
    def current_mA(self) -> FloatArray:
        """Commanded current (n,) [mA]."""
        ...

    @property
    def resistance_ohm(self) -> FloatArray:
        """Resistance reading (n,) [ohm]."""
        ...

    @property
    def deflection_um(self) -> FloatArray:
        """Deflection by the reference instrument (n,) [um]."""
        ...


def frequency_figure(rest: Loops, by_frequency: Mapping[float, Loops]) -> Figure:
    """Draw D against I and against R, quasi-static and by frequency [Hz]."""
    with house_style():
        figure = new_figure(10.0, 4.6)
        left, right = figure.subplots(1, 2, sharey=True)
        turn = int(np.argmin(rest.current_mA[int(np.argmax(rest.current_mA)) :])) + int(
            np.argmax(rest.current_mA)
        )
        paths = [("quasi-static", RAIL, rest, slice(0, turn + 1))]
        paths += [
            (f"{frequency:g} Hz", color, loop, slice(None))
            for color, (frequency, loop) in zip(CYCLE, by_frequency.items(), strict=False)
        ]
        scaled = fitting_unit("ohm", rest.resistance_ohm)
        for label, color, loop, part in paths:
            width = 3.0 if label == "quasi-static" else 1.2
            deflection = loop.deflection_um[part]
            left.plot(loop.current_mA[part], deflection, color=color, linewidth=width, label=label)
            right.plot(scaled.factor * loop.resistance_ohm[part], deflection, color=color, linewidth=width)
        left.set_xlabel("current [mA]")
        left.set_ylabel("deflection [µm]")
        right.set_xlabel(f"resistance [{printed_unit(scaled.unit)}]")
        right.set_xscale("log")
        few_decades(right.xaxis)
        left.legend(**ABOVE)
        headline(figure, "Deflection against current changes with frequency, against resistance hardly")
    return figure


def levels_figure(
    levels: Sequence[int],
    fit: Mapping[str, Sequence[float]],
    validation: Mapping[str, Sequence[float]],
    time_ns: Mapping[str, Sequence[float]],
    title: str,
) -> Figure:
    """Draw error on the fitted data, error on random currents and calculation time, each against the level."""
    with house_style():
        figure = new_figure(11.0, 4.2)
        panels = figure.subplots(1, 3)
        what = (
            (fit, "error on the fitted data [% of range]"),
            (validation, "error on random currents [% of range]"),
            (time_ns, "time a calculation [ns]"),
        )
        for axes, (values, label) in zip(panels, what, strict=True):
            for color, (name, series) in zip(CYCLE, values.items(), strict=False):
                axes.plot(levels, series, color=color, marker="o", markersize=4.0, label=name)
            axes.set_xlabel("plays, or levels of Preisach")
            axes.set_ylabel(label)
            axes.set_xticks(list(levels))
            axes.set_yscale("log")  # one bad fit must not hide the others
        panels[0].legend(**{**ABOVE, "ncols": 2})
        headline(figure, title)
    return figure


def errors_figure(
    time_s: FloatArray,
    shown: Mapping[str, FloatArray],
    errors: Mapping[str, FloatArray],
    *,
    labels: tuple[str, str],
    title: str,
    error_limit: float | None = None,
) -> Figure:
    """Draw setpoint and outputs above (first in black), and an error for each estimator below."""
    with house_style():
        figure = new_figure(10.0, 5.4)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.2))
        for color, (name, values) in zip((BLACK, *CYCLE), shown.items(), strict=False):
            draw_line(above, time_s, values, color, name)
        for color, (name, values) in zip(CYCLE, errors.items(), strict=False):
            draw_line(below, time_s, values, color, name)
        above.set_ylabel(labels[0])
        below.set_ylabel(labels[1])
        below.set_xlabel("time [s]")
        below.set_xlim(float(time_s[0]), float(time_s[-1]))
        if error_limit is not None:
            below.set_ylim(-error_limit, error_limit)
        above.legend(**ABOVE)
        below.legend(**{**ABOVE, "ncols": 5})
        headline(figure, title)
    return figure
