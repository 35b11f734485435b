"""One figure of an identification: measured loops under each model's, and the residual of each.

error = model − measured, in percent of the measured range of that quantity.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import ArrayLike

from rtctl.border.arrays import FloatArray
from rtctl.output.readable_units import printed_unit
from rtctl.plots.elements.channels import fitting_unit, spans_decades
from rtctl.plots.elements.decimation import extremes, path_points
from rtctl.plots.elements.errors import ErrorFigures, error_figures, percent
from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.elements.style import BLACK, CYCLE, few_decades, headline, house_style, new_figure, save_png

BEYOND = 1.6
"""Factor beyond the measured resistances at which their logarithmic axis ends."""
ModelOutputs = Mapping[str, tuple[ArrayLike | None, ArrayLike | None]]
"""Resistance [ohm] and deflection [um] of each model (n,), None where it has no such output."""


def plot_identification(
    path: Path,
    current_mA: ArrayLike,
    resistance_ohm: ArrayLike,
    deflection_um: ArrayLike,
    models: ModelOutputs,
    *,
    title: str = "Identification",
) -> None:
    """Write the figure of a fit as a PNG file: measured (n,) against each model's outputs there.

    NaN where there is no measurement or it is not to be scored. Raises ValueError where lengths differ or
    there is nothing to compare.
    """
    save_png(identification_figure(current_mA, resistance_ohm, deflection_um, models, title=title), path)


def identification_figure(
    current_mA: ArrayLike,
    resistance_ohm: ArrayLike,
    deflection_um: ArrayLike,
    models: ModelOutputs,
    *,
    title: str = "Identification",
) -> Figure:
    """Return the figure that `plot_identification` writes."""
    current = np.asarray(current_mA, np.float64)
    resistance = np.asarray(resistance_ohm, np.float64)
    scaled = fitting_unit("ohm", resistance)
    ohmic = {
        name: scaled.factor * np.asarray(r, np.float64) for name, (r, _) in models.items() if r is not None
    }
    in_um = {name: np.asarray(d, np.float64) for name, (_, d) in models.items() if d is not None}
    quantities = (
        _compare("resistance", printed_unit(scaled.unit), current, scaled.factor * resistance, ohmic),
        _compare("deflection", "µm", current, np.asarray(deflection_um, np.float64), in_um),
    )
    colors = {name: CYCLE[k % len(CYCLE)] for k, name in enumerate(models)}
    depth = max(len(quantity.ranked) for quantity in quantities)
    if depth == 0:
        raise ValueError("no model has an output to compare with a measurement")
    with house_style():
        figure = new_figure(11.5, 4.6 + 0.95 * depth)
        halves = figure.add_gridspec(1, 2)
        for k, quantity in enumerate(quantities):
            _draw_side(figure.add_subfigure(halves[0, k]), current, quantity, colors, depth)
        headline(figure, *_finding(title, quantities, len(current)))
    return figure


class _Quantity(NamedTuple):
    """One measured quantity beside every model of it; errors [% of range], best first in `ranked`."""

    name: str
    unit: str
    measured: FloatArray
    outputs: Mapping[str, FloatArray]
    errors: Mapping[str, FloatArray]
    scores: Mapping[str, ErrorFigures]
    ranked: list[str]


def _compare(
    name: str, unit: str, current: FloatArray, measured: FloatArray, outputs: Mapping[str, FloatArray]
) -> _Quantity:
    arrays = {f"measured {name}": measured, **outputs}
    wrong = [f"{key} {values.shape}" for key, values in arrays.items() if values.shape != current.shape]
    if wrong or current.ndim != 1:
        raise ValueError(
            f"current has shape {current.shape} (must be one-dimensional), but: {', '.join(wrong)}"
        )
    finite = measured[np.isfinite(measured)]
    width = float(np.ptp(finite)) if len(finite) else float("nan")
    errors = {key: 100.0 * (output - measured) / width for key, output in outputs.items()}
    scores = {key: figures for key, error in errors.items() if (figures := error_figures(error, 100.0))}
    ranked = sorted(scores, key=lambda key: scores[key].mean)
    return _Quantity(name, unit, measured, outputs, errors, scores, ranked)


def _draw_side(
    side: SubFigure, current: FloatArray, quantity: _Quantity, colors: Mapping[str, str], depth: int
) -> None:
    """Draw the plane above, one strip of error a model below it on a common scale, best first."""
    rows = list(side.subplots(1 + depth, 1, height_ratios=(4.0, *[1.0] * depth)))
    _draw_plane(rows[0], current, quantity, colors)
    limit = 1.1 * max((score.largest for score in quantity.scores.values()), default=0.0) or 1.0
    for k, strip in enumerate(rows[1:]):
        if k >= len(quantity.ranked):
            strip.set_axis_off()
            continue
        name = quantity.ranked[k]
        _draw_strip(strip, quantity.errors[name], colors[name], limit)
        score = quantity.scores[name]
        label = f"{name}: mean {percent(score.mean_percent)}, max {percent(score.max_percent)}"
        strip.set_title(label, fontsize=9.5, color=colors[name], pad=2.0)
        last = k == len(quantity.ranked) - 1
        strip.tick_params(labelbottom=last)
        strip.set_xlabel("sample [–]" if last else "")
        strip.set_ylabel("error [%]")
    side.align_ylabels()


def _draw_plane(axes: Axes, current: FloatArray, quantity: _Quantity, colors: Mapping[str, str]) -> None:
    """Draw the models as lines, the best one over the others, and the measurement above them as a thin black one."""
    for name in reversed(quantity.ranked):
        output = quantity.outputs[name]
        kept = path_points(current, output)
        axes.plot(current[kept], output[kept], color=colors[name], linewidth=3.0, alpha=0.7, label=name)
    axes.plot(current, quantity.measured, color=BLACK, linewidth=0.9, label="measured")
    axes.set_xlabel("current [mA]")
    axes.set_ylabel(f"{quantity.name} [{quantity.unit}]")
    if quantity.name == "resistance" and spans_decades(quantity.measured):
        axes.set_yscale("log")
        few_decades(axes.yaxis)
        seen = quantity.measured[np.isfinite(quantity.measured)]  # a model may go far below, or under zero
        axes.set_ylim(float(seen.min()) / BEYOND, float(seen.max()) * BEYOND)
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], **ABOVE)


def _draw_strip(axes: Axes, error: FloatArray, color: str, limit: float) -> None:
    kept = extremes(error)
    axes.plot(kept, error[kept], color=color, linewidth=0.9)
    axes.set_ylim(-limit, limit)
    axes.set_xlim(0, len(error) - 1)


def _finding(title: str, quantities: tuple[_Quantity, _Quantity], samples: int) -> tuple[str, str]:
    """Return the figures of the best models, and their names on the second line."""
    found = [(q.name, q.ranked[0], q.scores[q.ranked[0]]) for q in quantities if q.ranked]
    reached = ", ".join(f"{name} to {percent(score.mean_percent)}" for name, _, score in found)
    winners = ", ".join(f"{name}: {model}" for name, model, _ in found)
    detail = f"best for {winners} · error = model − measured in % of range, {samples} samples"
    return f"{title}: {reached} of range on average", detail
