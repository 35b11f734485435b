"""Noise of the measured drive is answered by the resonance: noise of a colour of its own, and nothing wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import answer_to, device, measured, noise_drive

IDS = "stiffness.cubic,damping.quadratic,friction.coulomb"
NOISE_V = 0.02
SAMPLES = 6000


def answer(folder: Path, *hidden: dict[str, object]) -> dict[str, Any]:
    """diagnosis.json of a device with a Q of 84 whose drive is known to 0.3 % of it."""
    plant = device(*hidden, damping=(1.5, "1/s"))
    records = []
    for seed, level, use in ((1, 6.0, "fit"), (2, 8.0, "fit"), (3, 7.0, "test")):
        drive = noise_drive(seed, level, SAMPLES)
        acting = drive + NOISE_V * np.random.default_rng(100 + seed).standard_normal(SAMPLES)
        records.append((drive, measured(plant, acting), use))
    return answer_to(folder, records, IDS)


@pytest.mark.slow
def test_of_a_right_model_nothing_is_wrong(tmp_path: Path) -> None:
    found = answer(tmp_path)
    assert found["verdict"] == "adequate"
    assert found["left_over_noise"] < 1.01


@pytest.mark.slow
def test_a_spring_that_hardens_by_as_much_as_that_noise_is_still_found(tmp_path: Path) -> None:
    cubic = {"id": "stiffness.cubic", "parameters": {"coefficient": {"value": 0.6, "unit": "1/(mm^2*s^2)"}}}
    found = answer(tmp_path, cubic)
    assert found["verdict"] == "explained"
    assert [one["id"] for one in found["causes"]] == ["stiffness.cubic"]
    assert found["causes"][0]["parameters"]["coefficient"]["value"] == pytest.approx(0.6, rel=0.3)
