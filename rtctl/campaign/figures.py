"""Pictures of a campaign: basins of attraction over a plane of two factors, a bifurcation diagram over one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.dataset as ds
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.campaign.plan import Plan
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RAIL,
    SKY,
    VERMILION,
    headline,
    house_style,
    new_figure,
    save_png,
)

COLORS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK, RAIL)
MOST_POINTS = 400_000


def draw_campaign(plan: Plan, folder: Path) -> None:
    """Draw DIR/campaign.png according to the campaign's [picture]."""
    picture = plan.campaign.picture
    if picture is None:
        return
    stored = ds.dataset(folder / "parts", format="parquet")
    asked = next(name for name in stored.schema.names if f"{name}_".startswith(f"{picture.show}_"))
    columns = [name for name in dict.fromkeys((picture.x, picture.y, asked)) if name is not None]
    table = stored.to_table(columns=columns)
    unit = (stored.schema.field(asked).metadata or {}).get(b"unit", b"").decode()
    with house_style():
        figure = new_figure(8.6, 5.6)
        axes = figure.add_subplot()
        x = table.column(picture.x).to_numpy()
        shown = table.column(asked)
        if picture.y is not None:
            _basins(figure, axes, x, table.column(picture.y).to_numpy(), shown.to_pylist())
            axes.set_ylabel(_label(plan, picture.y))
        else:
            values = shown.to_pylist()
            counts = [len(one) if isinstance(one, list) else 1 for one in values]
            flat = np.concatenate([np.atleast_1d(np.asarray(one, np.float64)) for one in values])
            _points(axes, np.repeat(x, counts), flat)
            axes.set_ylabel(asked.replace("_", " ") + (f" [{unit}]" if unit else ""))
        axes.set_xlabel(_label(plan, picture.x))
        headline(figure, plan.campaign.campaign.title, f"{plan.design.samples:,} trajectories")
        save_png(figure, folder / "campaign.png", "sweep")


def _label(plan: Plan, name: str) -> str:
    unit = next(axis.unit for axis in plan.design.axes if axis.name == name).replace("(mm)", "mm")
    return f"{name.replace('_', ' ')} [{unit}]"


def _basins(figure: Figure, axes: Axes, x: FloatArray, y: FloatArray, values: list[object]) -> None:
    """Draw each point in the colour of its final orbit; numbers in shades."""
    if all(isinstance(value, float) for value in values):
        drawn = _plane(axes, x, y, np.asarray(values, np.float64), None)
        figure.colorbar(drawn, ax=axes)
        return
    names = [str(value) for value in values]
    order = sorted(set(names), key=lambda name: (-names.count(name), name))
    colors = [COLORS[min(k, len(COLORS) - 1)] for k in range(len(order))]
    number = {name: k for k, name in enumerate(order)}
    _plane(axes, x, y, np.array([number[name] for name in names], np.float64), ListedColormap(colors))
    for color, name in list(zip(colors, order, strict=True))[: len(COLORS)]:
        share = 100.0 * names.count(name) / len(names)
        axes.plot([], [], "s", color=color, label=f"{name.replace('_', ' ')}, {share:.1f} %")
    figure.legend(loc="outside lower left", ncols=2)


def _plane(axes: Axes, x: FloatArray, y: FloatArray, value: FloatArray, colors: ListedColormap | None) -> Any:
    """Draw an image where the points are a grid, else dots."""
    across, up = np.unique(x), np.unique(y)
    axes.grid(visible=False)
    if len(across) * len(up) == len(x):
        image = np.empty((len(up), len(across)))
        image[np.searchsorted(up, y), np.searchsorted(across, x)] = value
        return axes.pcolormesh(across, up, image, cmap=colors, shading="nearest", rasterized=True)
    axes.margins(0.01)
    return axes.scatter(x, y, c=value, cmap=colors, s=(330.0 / np.sqrt(len(x))) ** 2, linewidths=0.0)


def _points(axes: Axes, x: FloatArray, y: FloatArray) -> None:
    step = max(1, len(x) // MOST_POINTS)
    axes.plot(x[::step], y[::step], ".", markersize=1.2, markeredgewidth=0.0, color=BLUE, alpha=0.6)
