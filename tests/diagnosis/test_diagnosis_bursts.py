"""Bursts and tones that a noise model takes for noise are said; noise of any colour is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, PERIOD_S, FloatArray, answer_to, device, measured, noise_drive
from scipy.signal import lfilter

TONE_HZ = 83.0


def noise(seed: int, kind: str) -> FloatArray:
    rng = np.random.default_rng(seed)
    white = rng.standard_normal(1500)
    if kind == "bursts":
        white = np.where(rng.random(1500) < 0.01, 10.0 * white, 0.05 * white)
    if kind == "tone":
        white = white + 0.7 * np.sin(
            2.0 * np.pi * TONE_HZ * PERIOD_S * np.arange(1500) + rng.uniform(0.0, 6.0)
        )
    poles = {"coloured": [1.0, -1.6, 0.8], "bursts": [1.0, -1.6, 0.8], "walk": [1.0, -0.999]}
    coloured = lfilter([1.0], poles.get(kind, [1.0]), white)
    return 5.0 * NOISE_MM * coloured / coloured.std()


@pytest.mark.parametrize(
    ("kind", "said"),
    [("white", ""), ("coloured", ""), ("walk", ""), ("bursts", "comes in bursts"), ("tone", "a tone of 0.0")],
)
def test_bursts_and_tones_are_said(tmp_path: Path, kind: str, said: str) -> None:
    records = [
        (noise_drive(k), measured(device(), noise_drive(k), 0.0) + noise(k + 100, kind), use)
        for k, use in ((1, "fit"), (2, "fit"), (3, "test"))
    ]
    found = answer_to(tmp_path, records)
    assert found["verdict"] == "adequate"
    notes = [one for one in found["warnings"] if "comes in bursts" in one or "holds a tone" in one]
    assert len(notes) == bool(said)
    assert all(said in note for note in notes)
    if kind == "tone":
        assert float(notes[0].split(" at ")[1].split(" Hz")[0]) == pytest.approx(TONE_HZ, abs=1.0 / 3.0)
