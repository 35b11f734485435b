"""Pictures of the bistable beam's study: clouds over frequency, restoring forces, phase portraits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.elements.style import (
    BLACK,
    BLUE,
    DOTS_PER_INCH,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    house_style,
    new_figure,
)

COLOURS = 96
COLORS = {
    "HM": BLUE, "local RM": VERMILION, "RM5": GREEN, "RM5c": PURPLE, "weak form": ORANGE, "truth": BLACK,
    "record": BLACK, "intrawell": SKY, "interwell": BLUE,
}  # fmt: skip


class Cloud(NamedTuple):
    """Points over frequency of one model; those of records through both wells are filled."""

    name: str
    frequency_hz: FloatArray
    value: FloatArray
    interwell: NDArray[np.bool_]


def draw(
    path: Path, size: tuple[float, float], shape: tuple[int, int], fill: Callable[[list[Axes]], None]
) -> None:
    """Yield a figure of `shape` axes, filled and saved in a few colours: a third of the bytes."""
    with house_style():
        figure: Figure = new_figure(*size)
        axes = np.atleast_1d(figure.subplots(*shape)).ravel().tolist()
        fill(axes)
        save_small_png(figure, path, colours=COLOURS, dots_per_inch=DOTS_PER_INCH)


def over_frequency(axes: Axes, clouds: Sequence[Cloud], label: str) -> None:
    """Draw a dot per record: open in one well, filled through both."""
    for k, cloud in enumerate(clouds):
        color = COLORS[cloud.name]
        shift = 0.05 * (k - 0.5 * (len(clouds) - 1))
        for inside, face, words in ((False, "none", "one well"), (True, color, "both wells, chaotic")):
            chosen = cloud.interwell == inside
            axes.plot(
                cloud.frequency_hz[chosen] + shift, cloud.value[chosen], "o", markersize=3.2, markerfacecolor=face,
                markeredgecolor=color, markeredgewidth=0.7, linestyle="none", label=f"{cloud.name}, {words}",
            )  # fmt: skip
    axes.set_xlabel("excitation frequency [Hz]")
    axes.set_ylabel(label)


def forces(axes: Axes, curves: Mapping[str, FloatArray], z: FloatArray, well_mm: float) -> None:
    """Draw restoring forces over displacement, the well as a cross."""
    for name, force in curves.items():
        axes.plot(
            z, force / 1000.0, color=COLORS[name], linewidth=2.2 if name == "truth" else 1.2, label=name
        )
    axes.plot([well_mm], [0.0], "x", color=BLACK, markersize=8, label="measured well")
    axes.set_xlabel("displacement [mm]")
    axes.set_ylabel("restoring force [m/s²]")
    axes.legend()


def portrait(axes: Axes, curves: Sequence[tuple[str, FloatArray, FloatArray]], title: str) -> None:
    """Draw velocity over displacement: the record as a thin line over the wider ones of models; each name once."""
    named: set[str] = set()
    for name, z, v in curves:
        is_record = name == "record"
        axes.plot(z, v, color=COLORS[name], linewidth=0.8 if is_record else 1.8, zorder=2.5 if is_record else 2.0,
                  label="_again" if name in named else name)  # fmt: skip
        named.add(name)
    axes.set_xlabel("displacement [mm]")
    axes.set_ylabel("velocity [mm/s]")
    axes.set_title(title, fontsize=9.0, pad=17.0)
    if curves:
        axes.legend(**ABOVE, fontsize=8.0, handlelength=1.0)
