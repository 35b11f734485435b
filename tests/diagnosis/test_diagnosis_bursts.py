"""Bursts that a noise model takes for noise are said; noise of any colour is not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, FloatArray, device, measured, noise_drive, write_case
from scipy.signal import lfilter

from rtctl.cli import main


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
    manifest = write_case(tmp_path, records)
    command = ["diagnose", str(manifest), "--model", str(tmp_path / "model.toml"), "--quiet"]
    assert main([*command, "--mechanisms", "friction.coulomb", "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] == "adequate"
    assert any("comes in bursts" in warning for warning in found["warnings"]) == said
