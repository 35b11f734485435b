"""A limit of a reading or a drive is found where few samples reach it, many times the RMS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import SAMPLES, answer_to, device, measured, noise_drive

BURST = 0.12 + np.exp(-0.5 * ((np.arange(SAMPLES) - 600.0) / 25.0) ** 2)
"""A short burst in each record: peaks of more than 5 times the RMS."""


@pytest.mark.parametrize(
    ("identity", "share", "ids"),
    [
        ("sensor.saturation", 0.8, "sensor.saturation,damping.nonlinear,stiffness.cubic"),
        ("drive.saturation", 0.7, "drive.saturation,damping.nonlinear,stiffness.cubic"),
    ],
)
def test_what_is_cut_off_in_a_short_burst_is_found_at_its_limit(
    tmp_path: Path, identity: str, share: float, ids: str
) -> None:
    drives = [BURST * noise_drive(seed, 9.0) for seed in (1, 2, 3)]
    signal, unit = (drives[0], "V") if identity.startswith("drive") else (measured(device(), drives[0]), "mm")
    limit = share * float(np.abs(signal).max())
    assert limit > 3.5 * signal.std()
    parameters = {"clipped": {"value": 1.0, "unit": ""}, "limit": {"value": limit, "unit": unit}}
    cut = device({"id": identity, "parameters": parameters})
    uses = ("fit", "fit", "test")
    records = [(drive, measured(cut, drive), use) for drive, use in zip(drives, uses, strict=True)]
    (cause,) = answer_to(tmp_path, records, ids)["causes"]
    assert cause["id"] == identity
    assert cause["parameters"]["limit"]["value"] == pytest.approx(limit, rel=0.02)
    assert cause["parameters"]["clipped"]["value"] == pytest.approx(1.0, abs=0.1)
