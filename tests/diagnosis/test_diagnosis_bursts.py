"""Bursts that a noise model takes for noise are said; noise of any colour is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, FloatArray, answer_to, device, measured, noise_drive
from scipy.signal import lfilter


def noise(seed: int, kind: str) -> FloatArray:
    rng = np.random.default_rng(seed)
    white = rng.standard_normal(1500)
    if kind == "bursts":
        white = np.where(rng.random(1500) < 0.01, 10.0 * white, 0.05 * white)
    coloured = lfilter([1.0], [1.0, -1.6, 0.8] if kind != "white" else [1.0], white)
    return 5.0 * NOISE_MM * coloured / coloured.std()


@pytest.mark.parametrize(("kind", "said"), [("white", False), ("coloured", False), ("bursts", True)])
def test_bursts_are_said(tmp_path: Path, kind: str, said: bool) -> None:
    records = [
        (noise_drive(k), measured(device(), noise_drive(k), 0.0) + noise(k + 100, kind), use)
        for k, use in ((1, "fit"), (2, "fit"), (3, "test"))
    ]
    found = answer_to(tmp_path, records)
    assert found["verdict"] == "adequate"
    assert any("comes in bursts" in warning for warning in found["warnings"]) == said
