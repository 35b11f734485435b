"""The page's pictures can be read whatever the range of what they show."""

from __future__ import annotations

from itertools import pairwise

import pytest

from rtctl.plots.diagnosis_ranking import candidates_figure


@pytest.mark.parametrize("nominal", [3e-3, 1.5e-2, 0.3, 40.0])
def test_the_errors_that_candidates_leave_stand_on_ticks_that_do_not_touch(nominal: float) -> None:
    figure = candidates_figure(["a", "b"], [2.1e-3, 0.9 * nominal], [True, False], nominal, 1.9e-3, "um")
    figure.draw_without_rendering()
    axis = figure.axes[0].xaxis
    low, high = figure.axes[0].get_xlim()
    ticks = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    boxes = [tick.label1.get_window_extent() for tick in ticks if tick.label1.get_text()]
    assert len(boxes) >= 2
    assert all(one.x1 < other.x0 for one, other in pairwise(boxes))
    assert not [label.get_text() for label in axis.get_minorticklabels() if label.get_text()]
