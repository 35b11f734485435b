"""The picture of a comparison is drawn whatever was measured: zeros, constants, a model that leaves the data."""

from __future__ import annotations

import numpy as np
import pytest

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
