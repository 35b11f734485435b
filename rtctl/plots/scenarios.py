"""Our errors beside the paper's, a pair of bars a scenario: mean error in percent of the device's range."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.plots.elements.errors import percent
from rtctl.plots.elements.style import BLUE, RAIL, headline, house_style, new_figure, save_png

Row = tuple[str, float | None, float | None]
"""Scenario, our mean error and the paper's [% of range]; None without a figure."""


def plot_scenarios(path: Path, rows: Sequence[Row], *, title: str = "Mean error") -> None:
    """Write the bar chart as a PNG file, scenarios from the top as given. Raises ValueError without rows."""
    save_png(scenarios_figure(rows, title=title), path)


def scenarios_figure(rows: Sequence[Row], *, title: str = "Mean error") -> Figure:
    """Return the figure that `plot_scenarios` writes."""
    if not rows:
        raise ValueError("a chart of scenarios needs at least one row")
    with house_style():
        figure = new_figure(9.0, 1.5 + 0.62 * len(rows))
        axes = figure.add_subplot()
        _draw_bars(axes, [row[1] for row in rows], -0.19, BLUE, "this program, simulated device", "not run")
        _draw_bars(axes, [row[2] for row in rows], 0.19, RAIL, "paper, measured device", "")
        axes.set_yticks(range(len(rows)), [row[0] for row in rows], fontsize=10.5)
        axes.tick_params(axis="y", length=0)
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.set_xlabel("mean error [% of range]")
        axes.margins(x=0.12)
        axes.set_xlim(left=0.0)
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.1)
        headline(figure, _finding(title, rows))
    return figure


def _draw_bars(
    axes: Axes, values: Sequence[float | None], offset: float, color: str, label: str, absent: str
) -> None:
    """Draw bars with their values at the end; `absent` where there is none."""
    y = np.arange(len(values)) + offset
    axes.barh(y, [value or 0.0 for value in values], height=0.36, color=color, label=label)
    for position, value in zip(y, values, strict=True):
        text = absent if value is None else percent(value)
        end = (value or 0.0, position)
        axes.annotate(text, end, xytext=(4, 0), textcoords="offset points", va="center", fontsize=9.5)


def _finding(title: str, rows: Sequence[Row]) -> str:
    """Return in how many scenarios we are better, and by what factor (geometric mean)."""
    pairs = [(ours, paper) for _, ours, paper in rows if ours and paper]
    if not pairs:
        return title
    ahead = sum(ours < paper for ours, paper in pairs)
    factor = float(np.exp(np.mean([np.log(paper / ours) for ours, paper in pairs])))
    overall = f", {factor:.1f} times lower overall" if factor > 1.05 else ""
    return f"{title}: below the paper's in {ahead} of {len(pairs)} scenarios{overall}"
