"""Causes that were judged by the initial parts of records are held to the test records all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from diagnosis_cases import FloatArray, answer_to, device, measured, noise_drive


def late(drive: FloatArray, gain: float = 1.0) -> FloatArray:
    """A reading that comes twelve samples late, which free runs of the nominal model soon do not follow."""
    return gain * np.concatenate([np.zeros(12), measured(device(), drive)[:-12]])


def answer(folder: Path, gain_of_test: float) -> dict[str, object]:
    drives = [noise_drive(seed, samples=3000) for seed in (1, 2)]
    records = [(drives[0], late(drives[0]), "fit"), (drives[1], late(drives[1], gain_of_test), "test")]
    return answer_to(folder, records, "drive.delay")


def test_a_cause_of_the_parts_explains_a_test_record_that_agrees(tmp_path: Path) -> None:
    found = answer(tmp_path, 1.0)
    assert any("drive.delay the model follows" in note for note in found["warnings"]), "parts came first"
    assert found["verdict"] == "explained"


def test_a_test_record_that_the_causes_miss_contradicts_them(tmp_path: Path) -> None:
    """It was told as explained beside a test error of 287 times the noise."""
    found = answer(tmp_path, 1.4)
    assert found["verdict"] == "partly_explained"
    assert any("on the test records" in note and "times the noise" in note for note in found["warnings"])
