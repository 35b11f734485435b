"""A residual is judged by its size and by whether it looks like noise."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.identification.residual_words import judge_residual

NOISE = np.random.default_rng(1).normal(size=4000)
WAVE = np.sin(2.0 * np.pi * np.arange(4000) / 40.0)  # 40 samples a period


@pytest.mark.parametrize(
    ("share", "judged"),
    [(0.01, "good"), (0.085, "fair (5 % or less is good)"), (0.2, "poor"), (0.5, "too much")],
)
def test_the_size_is_judged(share: float, judged: str) -> None:
    assert judge_residual(share).startswith(judged)


def test_noise_and_what_the_model_lacks_are_told_apart() -> None:
    assert "looks like noise" in judge_residual(0.2, [NOISE])
    assert "smoother than noise" in judge_residual(0.02, [WAVE])
    assert "looks like noise" in judge_residual(0.02, [NOISE + 0.3 * WAVE])
    assert "smoother than noise" in judge_residual(0.02, [0.3 * NOISE + WAVE])
    assert judge_residual(0.02, [np.zeros(100)]) == "good"
