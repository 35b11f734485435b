"""What a right answer leaves is what the noise itself leaves, less a square for each number that was fitted."""

from __future__ import annotations

import pytest
from against_truth import left_over_truth


@pytest.mark.parametrize(
    "noise",
    [pytest.param(noise, marks=pytest.mark.slow) for noise in ("one-over-f", "white", "quantised")],
)
def test_a_right_answer_leaves_no_more_than_the_truth(noise: str) -> None:
    found = left_over_truth(200_040, effects=("stiffness.quintic",), samples=4000, noise=noise)
    assert found.names == ("stiffness.quintic",)
    assert found.nominal > 1000.0
    assert -3.0 * found.fitted < found.named < found.fitted
