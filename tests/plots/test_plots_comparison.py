"""The picture of a comparison is drawn whatever was measured: zeros, constants, a model that leaves the data."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rtctl.plots.comparison import Compared, comparison_figure

TIME_S = 1e-3 * np.arange(400)
WAVE = np.sin(200.0 * TIME_S)


def compared(measured: np.ndarray, simulated: np.ndarray) -> Compared:
    return Compared(
        title="r", output="displacement", unit="mm", time_s=TIME_S, measured=measured, simulated=simulated
    )


@pytest.mark.parametrize("measured", [0.0 * WAVE, 0.0 * WAVE + 0.7, WAVE], ids=["zero", "constant", "wave"])
@pytest.mark.parametrize("simulated", [0.0 * WAVE, 0.0 * WAVE + 0.7, WAVE], ids=["zero", "constant", "wave"])
def test_a_comparison_is_drawn(measured: np.ndarray, simulated: np.ndarray) -> None:
    figure = comparison_figure(compared(measured, simulated))
    figure.canvas.draw()


def test_a_motion_where_nothing_was_measured_is_no_divergence() -> None:
    one = compared(0.0 * WAVE, WAVE)
    assert one.scored == slice(0, 400)
    assert compared(WAVE, np.where(TIME_S < 0.1, WAVE, 1e9)).scored.stop == 100


def test_an_error_of_a_temperature_is_told_by_how_much_it_varies_and_flattens_no_axis() -> None:
    warm = compared(300.0 + 5.0 * WAVE, 300.0 + 5.05 * WAVE)
    figure = comparison_figure(warm)
    assert "off by 1 % of its variation" in figure.get_suptitle() or any(
        "off by 1 % of its variation" in text.get_text() for text in figure.texts
    )
    moment = next(axes for axes in _panels(figure) if "around the largest error" in axes.get_xlabel())
    assert moment.get_ylim()[0] > 290.0
    near = next(axes for axes in _panels(comparison_figure(compared(WAVE, 1.01 * WAVE)))
                if "around the largest error" in axes.get_xlabel())  # fmt: skip
    assert [line.get_label() for line in near.lines] == ["simulated", "measured", "error"]


def _panels(figure: Figure) -> list[Axes]:
    return [axes for part in figure.subfigs for axes in part.axes] + list(figure.axes)
