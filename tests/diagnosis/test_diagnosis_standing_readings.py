"""A sensor that falls out amid a motion is said; a mass that sticks, a device at rest and coarse readings are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, SAMPLES, device, measured, noise_drive, write_case
from numpy.typing import NDArray

import rtctl
from rtctl.cli.printing.diagnosis import print_diagnosis
from rtctl.diagnosis.report.page.summary import describe_verdict
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.screening.excitation_checks import note_standing_readings
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.measured.dataset import Record

T = np.arange(2000) * 2e-3
MOTION = np.sin(2 * np.pi * 18.0 * T) + 1e-3 * np.random.default_rng(0).standard_normal(len(T))


def fallen_out(values: NDArray[np.float64], first: int = 700, rows: int = 50) -> NDArray[np.float64]:
    """The readings with some rows at 0."""
    changed = values.copy()
    changed[first : first + rows] = 0.0
    return changed


def sticking() -> NDArray[np.float64]:
    """A motion without noise that slows down to rest, sticks for 40 rows and begins again."""
    swing = np.cumsum(np.abs(np.sin(2 * np.pi * 0.5 * T)) ** 3) * 1e-2
    return np.concatenate([swing[:500], np.full(40, swing[500]), swing[500:]])


def noted(values: NDArray[np.float64]) -> list[str]:
    record = Record(name="r", period_s=2e-3, signals={"displacement": values})
    return note_standing_readings([record], "displacement", "mm", ScreeningThresholds())


def test_a_sensor_that_falls_out_is_said_with_its_place() -> None:
    (said,) = noted(fallen_out(MOTION))
    assert "reads 0 mm in 50 rows after each other, from 1.4 s on" in said


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(MOTION, id="a motion"),
        pytest.param(fallen_out(MOTION, rows=4), id="a few rows"),
        pytest.param(fallen_out(MOTION, first=0), id="a device at rest before its drive begins"),
        pytest.param(np.clip(MOTION, -0.8, 0.8), id="a clipped sensor"),
        pytest.param(np.round(MOTION * 4.0) / 4.0, id="coarse readings"),
        pytest.param(sticking(), id="a mass that sticks"),
    ],
)
def test_what_may_stand_for_other_reasons_is_not(values: NDArray[np.float64]) -> None:
    assert noted(values) == []


def diagnosed(folder: Path, spoilt: NDArray[np.float64]) -> Diagnosis:
    """The answer to two records of the nominal device, the first with readings that were spoilt."""
    drives = [noise_drive(1), noise_drive(2)]
    readings = [measured(device(), drive) for drive in drives]
    records = [(drives[0], readings[0] + spoilt, "fit"), (drives[1], readings[1], "test")]
    manifest = write_case(folder, records)
    return rtctl.diagnose(manifest, folder / "model.toml", mechanisms="friction.coulomb").answer


def test_a_diagnosis_says_it(tmp_path: Path) -> None:
    reading = measured(device(), noise_drive(1))
    found = diagnosed(tmp_path, fallen_out(reading) - reading)
    assert any("did the sensor fall out?" in warning for warning in found.warnings)


def test_nothing_is_wrong_is_not_said_beside_bursts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    burst = np.zeros(SAMPLES)
    burst[600:625] = 12.0 * NOISE_MM * np.random.default_rng(4).standard_normal(25)
    found = diagnosed(tmp_path, burst)
    print_diagnosis(found, tmp_path)
    said = capsys.readouterr().out
    assert found.verdict == "adequate"
    assert "Nothing is wrong" not in said
    assert "what is left comes in bursts" in said
    assert "what is left comes in bursts" in describe_verdict(found)


def test_nothing_is_wrong_is_said_beside_noise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = diagnosed(tmp_path, np.zeros(SAMPLES))
    print_diagnosis(found, tmp_path)
    assert "Nothing is wrong: what is left is noise." in capsys.readouterr().out
