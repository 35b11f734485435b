"""One look for every figure: sizes, the colour-blind-safe palette of Okabe and Ito, PNG files.

No pyplot: a figure is an object that is drawn by Agg and then forgotten, so nothing needs a display or leaks.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of

BLACK, GREY, RAIL = "#000000", "#767676", "#C4C4C4"
BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)

DOTS_PER_INCH = 160
NOTEBOOK_DOTS_PER_INCH = 90

_RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.2,
    "lines.solid_joinstyle": "round",
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "path.simplify_threshold": 0.2,
}


@contextmanager
def house_style() -> Iterator[None]:
    """Apply our sizes and colours on matplotlib's defaults inside the block, whatever a matplotlibrc says."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_RC)
        yield


class HouseFigure(Figure):
    """A figure that is drawn in the house style wherever it is saved, and that a notebook shows."""

    def savefig(self, fname: Any, **options: Any) -> None:
        """Draw into a file or a buffer, as matplotlib's own method does."""
        with house_style():
            if set(options) - {"metadata"} == {"format", "dpi"} and options["format"] == "png":
                self._save_png(fname, options["dpi"], options.get("metadata"))
            else:
                super().savefig(fname, **options)

    def _save_png(self, fname: Any, dpi: float, metadata: dict[str, str] | None) -> None:
        """Write the same bytes as matplotlib, which draws twice where there is a layout: once to lay out."""
        canvas: Any = FigureCanvasAgg(self)
        before = self.dpi
        self.dpi = dpi
        try:
            canvas.print_png(fname, metadata=metadata)
        finally:
            self.dpi = before

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=NOTEBOOK_DOTS_PER_INCH)
        return buffer.getvalue()


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure [inch] with its own Agg canvas and constrained layout."""
    figure = HouseFigure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def headline(figure: Figure, finding: str, detail: str = "") -> None:
    """Write the finding in bold over the whole figure, and a second line under it; long ones are set smaller."""
    width, height = figure.get_figwidth(), figure.get_figheight()
    size = min(13.0, 108.0 * width / len(finding))
    text = f"{finding}\n" if detail else finding  # reserves both lines: the second has another weight
    figure.suptitle(text, x=0.008, ha="left", fontsize=size, fontweight="bold")
    if detail:
        size = min(10.0, 118.0 * width / len(detail))
        figure.text(0.008, 1.0 - 0.31 / height, detail, ha="left", va="top", fontsize=size)


def save_png(figure: Figure, path: Path, command: str = "plot") -> None:
    """Draw into the PNG file `path`, whole or not at all.

    Raises InputError where a file is there that `command` did not write.
    """
    with house_style(), replacing(path, command) as partial:
        figure.savefig(partial, format="png", dpi=DOTS_PER_INCH, metadata={"Software": mark_of(command)})


def few_decades(axis: Axis) -> None:
    """Set ticks of a logarithmic axis over a few decades: they read 10, 20, 50, 100."""
    axis.set_major_locator(mpl.ticker.LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(mpl.ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(mpl.ticker.NullFormatter())
