"""The two numbers a figure states about an error, and the axis that shows most of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from rtctl.border.arrays import FloatArray


class ErrorFigures(NamedTuple):
    """Mean and largest absolute error, in the unit of the quantity and in percent of its range."""

    mean: float
    largest: float
    mean_percent: float
    max_percent: float


def error_figures(error: FloatArray, width: float) -> ErrorFigures | None:
    """Return figures of the finite samples of `error` (n,) against a range `width`; None where there are none."""
    if not width > 0.0:
        raise ValueError(f"the range that percents refer to must be > 0, got {width!r}")
    size = np.abs(error[np.isfinite(error)])
    if len(size) == 0:
        return None
    mean, largest = float(size.mean()), float(size.max())
    return ErrorFigures(mean, largest, 100.0 * mean / width, 100.0 * largest / width)


def percent(value: float) -> str:
    """Format as the paper's tables do below ten (1.95 %), and in whole numbers above (71 %)."""
    return f"{value:.2f} %" if value < 10.0 else f"{value:.0f} %"


def shown_limit(error: FloatArray, spread: float) -> float:
    """Return the half height of an error axis: the largest error, or `spread` times the 90th percentile if less.

    With a spread of 2, noise and a sine's error are shown whole, and the part between the jumps for steps.
    """
    size = np.abs(error[np.isfinite(error)])
    if len(size) == 0:
        return 0.0
    return float(min(size.max(), spread * np.percentile(size, 90.0)))


def percent_axis(axes: Axes, width: float) -> None:
    """Add a second y axis on the right: percent of the range `width` [unit of the y axis]."""

    def to_percent(y: ArrayLike) -> ArrayLike:
        return 100.0 * np.asarray(y) / width

    def from_percent(p: ArrayLike) -> ArrayLike:
        return np.asarray(p) * width / 100.0

    axes.secondary_yaxis("right", functions=(to_percent, from_percent)).set_ylabel("error [% of range]")
