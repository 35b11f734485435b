"""One more record of a case is of the same device, by the same sensors, and the manifest has it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from generator import generate, more

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked

SIZES: dict[str, dict[str, Any]] = {
    "oscillator": {
        "samples": 900, "fit_records": 1, "test_records": 1, "samples_a_period": 20.0, "hold": "zero", "noise": "white",
        "effects": ("drive.lag",), "slices": False,
    },
    "vo2": {
        "samples": 600, "fit_records": 1, "test_records": 1, "identify_records": 1, "sample_rate_Hz": 1000.0,
        "noise": "white", "effects": ("sensor.lag",), "missing_deflection": False,
    },
}  # fmt: skip


@pytest.mark.parametrize(("plant", "output"), [("oscillator", "displacement"), ("vo2", "resistance")])
def test_the_same_drive_moves_the_same_device_by_the_same_noise(
    plant: str, output: str, tmp_path: Path
) -> None:
    truth = generate(100_501, tmp_path, plant=plant, **SIZES[plant])
    old = next(record for record in truth.records if record.use == "fit")
    (name,) = more(100_501, tmp_path, old.drive, 1.0 / truth.sample_rate_Hz, plant=plant, **SIZES[plant])

    manifest = tomllib.loads((tmp_path / "dataset.toml").read_text())
    added = manifest["records"][-1]
    assert (added["file"], added["use"]) == (name, "fit")
    assert added["sample_rate_hz"] == pytest.approx(truth.sample_rate_Hz)
    measured = np.load(tmp_path / name)[manifest["signals"][output].get("column", output)]
    clean = old.clean[output] if plant == "vo2" else old.clean
    noise = truth.noises[output] if plant == "vo2" else truth.noise
    left = measured - clean
    spread = noise.rms / np.sqrt(2.0 * left.size)
    assert np.sqrt(np.mean(left**2)) == pytest.approx(noise.rms, abs=4.0 * spread)
    old_left = (old.measured[output] if plant == "vo2" else old.measured) - clean
    assert abs(np.corrcoef(left, old_left)[0, 1]) < 4.0 / np.sqrt(left.size)  # noise of its own


def test_another_period_is_another_record_of_the_same_device(tmp_path: Path) -> None:
    """Half the period, each level twice: the same drive of a converter, so the same motion."""
    truth = generate(100_502, tmp_path, **SIZES["oscillator"] | {"snr_dB": 60.0})
    old = next(record for record in truth.records if record.use == "fit")
    twice = np.repeat(old.drive, 2)
    (name,) = more(
        100_502, tmp_path, twice, 0.5 / truth.sample_rate_Hz, **SIZES["oscillator"] | {"snr_dB": 60.0}
    )
    column = tomllib.loads((tmp_path / "dataset.toml").read_text())["signals"]["displacement"]
    measured = np.load(tmp_path / name)[column.get("column", "displacement")]
    assert np.std(measured[::2] - old.clean) < 1.3 * truth.noise.rms


def test_a_record_that_is_repeated_has_noise_of_its_own(tmp_path: Path) -> None:
    truth = generate(100_503, tmp_path, **SIZES["oscillator"])
    drive = next(record for record in truth.records if record.use == "fit").drive
    names = more(100_503, tmp_path, drive, 1.0 / truth.sample_rate_Hz, times=2, **SIZES["oscillator"])
    manifest = tomllib.loads((tmp_path / "dataset.toml").read_text())
    assert [record["file"] for record in manifest["records"][-2:]] == names
    column = manifest["signals"]["displacement"].get("column", "displacement")
    one, other = (np.load(tmp_path / name)[column] for name in names)
    assert np.std(one - other) == pytest.approx(np.sqrt(2.0) * truth.noise.rms, rel=0.15)


def test_noise_of_a_record_at_twice_the_period_is_as_fast_in_time(tmp_path: Path) -> None:
    """Of neighbours two periods of the case apart an autoregression of first order has the square of its pole."""
    sizes = SIZES["oscillator"] | {"noise": "ar1", "samples": 9000}
    truth = generate(100_504, tmp_path, **sizes)
    old = next(record for record in truth.records if record.use == "fit")
    pole = neighbours(old.measured - old.clean)
    levels = (
        np.repeat(np.where(np.random.default_rng(1).random(900) < 0.5, -1.0, 1.0), 10)
        * np.abs(old.drive).max()
    )
    manifest = tomllib.loads((tmp_path / "dataset.toml").read_text())
    column = manifest["signals"]["displacement"].get("column", "displacement")
    names = more(100_504, tmp_path, levels, 2.0 / truth.sample_rate_Hz, times=2, **sizes)
    one, other = (np.load(tmp_path / name)[column] for name in names)
    assert neighbours(one - other) == pytest.approx(pole**2, abs=0.05)


def neighbours(noise: np.ndarray) -> float:
    """Correlation of each with the next."""
    return float(noise[1:] @ noise[:-1] / (noise @ noise))


@pytest.mark.parametrize("drive", [np.zeros((3, 2)), np.array([1.0]), np.array([0.0, np.nan])])
def test_a_drive_that_is_none_is_refused(drive: np.ndarray, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="finite levels"):
        more(1, tmp_path, drive, 1e-3)
