"""Causes that explain initial parts of records let the model follow further: what acts only there is found too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import answer_to, device, measured, noise_drive

SAMPLES, SOFT = 3000, 1500
LATE_S, PLACE_MM, STIFFNESS = 5e-3, 1.2, 6e4
IDS = "timing.skew,stop.one_sided,stiffness.cubic,damping.quadratic,drive.lag"


def answer(folder: Path, later: float) -> dict[str, Any]:
    """Records that are read late; from their middle on the drive is larger, and the motion reaches a stop."""
    skew = {"id": "timing.skew", "parameters": {"late": {"value": LATE_S, "unit": "s"}}}
    stop = {
        "id": "stop.one_sided",
        "parameters": {
            "above": {"value": STIFFNESS, "unit": "1/s^2"}, "place": {"value": PLACE_MM, "unit": "mm"},
        },
    }  # fmt: skip
    hidden = device(skew, stop, damping=(4.0, "1/s"))
    grows = np.where(np.arange(SAMPLES) < SOFT, 1.0, later)
    drives = [
        (grows * noise_drive(seed, 2.0, SAMPLES), use) for seed, use in ((1, "fit"), (2, "fit"), (3, "test"))
    ]
    assert np.abs(measured(device(damping=(4.0, "1/s")), drives[0][0], 0.0)[:SOFT]).max() < PLACE_MM
    return answer_to(folder, [(drive, measured(hidden, drive), use) for drive, use in drives], IDS)


def test_a_stop_behind_late_readings_is_found_where_the_model_follows_with_them(tmp_path: Path) -> None:
    """The readings are so late that the nominal model leaves the records before the motion reaches the stop."""
    found = answer(tmp_path, 3.0)
    assert found["verdict"] == "explained"
    late, stop = sorted(found["causes"], key=lambda cause: cause["id"], reverse=True)
    assert (late["id"], stop["id"]) == ("timing.skew", "stop.one_sided")
    assert late["parameters"]["late"]["value"] == pytest.approx(LATE_S, rel=1e-3)
    assert stop["parameters"]["place"]["value"] == pytest.approx(PLACE_MM, rel=2e-3)
    assert stop["parameters"]["above"]["value"] == pytest.approx(STIFFNESS, rel=0.02)
    assert found["gain"]["ratio_low"] > 20.0
    assert any("with timing.skew the model follows" in text for text in found["warnings"])


def test_longer_parts_that_need_no_more_causes_determine_the_same_ones(tmp_path: Path) -> None:
    found = answer(tmp_path, 1.0)
    assert found["verdict"] == "explained"
    assert [cause["id"] for cause in found["causes"]] == ["timing.skew"]
    assert found["gain"]["ratio_low"] > 20.0
