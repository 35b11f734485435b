"""A second mode far above the motion's frequency is looked for, and is no tone of a moving base."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import SAMPLES, answer_to, device, measured, noise_drive

MODE_HZ = 210.0
"""Ten times the device's own frequency; the search went to eight times that of the motion."""
MODE = {
    "id": "mode.second",
    "parameters": {
        "gain": {"value": 3e4, "unit": "mm/s^2/V"},
        "frequency": {"value": MODE_HZ, "unit": "Hz"},
        "damping_ratio": {"value": 0.01, "unit": "dimensionless"},
    },
}


def test_a_mode_ten_times_higher_is_named(tmp_path: Path) -> None:
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = noise_drive(seed) + 0.5 * np.random.default_rng(seed + 20).standard_normal(SAMPLES)
        records.append((drive, measured(device(MODE), drive), use))
    found = answer_to(tmp_path, records, "mode.second,base.motion,sensor.hum,friction.coulomb")
    assert [cause["id"] for cause in found["causes"]] == ["mode.second"]
    frequency = found["causes"][0]["parameters"]["frequency"]
    assert frequency["value"] == pytest.approx(MODE_HZ, rel=0.01)
