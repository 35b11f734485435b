"""No green verdict for a model that follows nothing, nor where test records contradict the fitted ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, FloatArray, answer_to, device, measured, noise_drive

FEW = "friction.coulomb,stiffness.cubic"
Records = list[tuple[FloatArray, FloatArray, str]]


def diagnosed(folder: Path, records: Records) -> tuple[str, list[str]]:
    """Verdict and warnings."""
    found = answer_to(folder, records, FEW)
    return found["verdict"], found["warnings"]


def records_of(seeds: tuple[int, ...], noise: float = NOISE_MM, shift: int = 0) -> Records:
    """The last is the test record; `shift`: by so much the seed of the drive in the file is another."""
    plant, uses = device(), ["fit"] * (len(seeds) - 1) + ["test"]
    return [
        (noise_drive(seed + shift), measured(plant, noise_drive(seed), noise), use)
        for seed, use in zip(seeds, uses, strict=True)
    ]


def test_a_drive_that_is_not_the_one_of_the_motion_makes_no_model_adequate(tmp_path: Path) -> None:
    verdict, warnings = diagnosed(tmp_path, records_of((1, 2, 3), shift=100))
    assert verdict == "unexplained"
    assert any("a model that follows nothing is not adequate" in one for one in warnings)


@pytest.mark.slow
def test_a_cause_that_leaves_nearly_all_of_the_motion_explains_nothing(tmp_path: Path) -> None:
    """A constant is taken away, and the motion that the drive in the file did not make is left."""
    records = [
        (drive, reading + 2.0 * reading.std(), use)
        for drive, reading, use in records_of((1, 2, 3), shift=100)
    ]
    found = answer_to(tmp_path, records, "sensor.offset")
    assert (found["verdict"], found["causes"], found["model"]) == ("unexplained", [], None)
    assert any("leaves 100% of the displacement's RMS" in one for one in found["warnings"])


def test_white_noise_larger_than_the_motion_leaves_a_right_model_adequate(tmp_path: Path) -> None:
    motion = float(np.std(measured(device(), noise_drive(1))))
    verdict, warnings = diagnosed(tmp_path, records_of((1, 2, 3), noise=2.0 * motion))
    assert verdict == "adequate"
    assert not any("follows nothing" in one for one in warnings)


@pytest.mark.parametrize("gain", [1.0, 1.3])
def test_a_test_record_with_another_sensor_gain_is_a_gap(tmp_path: Path, gain: float) -> None:
    *fit_hypothesis, (drive, reading, use) = records_of((1, 2, 3))
    verdict, warnings = diagnosed(tmp_path, [*fit_hypothesis, (drive, gain * reading, use)])
    assert verdict == ("adequate" if gain == 1.0 else "unexplained")
    assert any("measured or written otherwise" in one for one in warnings) == (gain != 1.0)


def test_an_error_there_of_parameters_that_the_fitted_records_leave_open_is_no_gap(tmp_path: Path) -> None:
    """Fitted far below the resonance, where neither damping nor mass show."""
    time_s = 2e-3 * np.arange(1500)
    slow = [4.0 * np.sin(2.0 * np.pi * f * time_s + 0.4) for f in (0.5, 0.8)]
    drives = [(slow[0], "fit"), (slow[1], "fit"), (noise_drive(3), "test")]
    records = [(drive, measured(device(), drive), use) for drive, use in drives]
    verdict, warnings = diagnosed(tmp_path, records)
    assert verdict == "adequate"
    assert not any("measured or written otherwise" in one for one in warnings)
