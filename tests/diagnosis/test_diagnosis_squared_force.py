"""An electrostatic actuator, whose force goes with the square of its voltage, is identified and named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import write_records
from scipy.signal import lsim

import rtctl

RATE_HZ = 20_000.0
SAMPLES, HELD, INSTANTS = 3000, 100, 8
NATURAL_1_S, DAMPING_RATIO, UM_PER_V2 = 2.0 * np.pi * 1850.0, 0.055, 1.35e-3
UNITS = {"drive": "V", "displacement": "um"}


@pytest.fixture
def comb(tmp_path: Path) -> Path:
    """Three records of random levels from 0 to 40 V, from rest."""
    rng, records = np.random.default_rng(1), []
    for use in ("fit", "fit", "test"):
        drive = np.repeat(rng.choice(np.arange(0.0, 41.0, 5.0), SAMPLES // HELD), HELD)
        drive[:HELD] = 0.0
        t = np.arange(SAMPLES * INSTANTS) / RATE_HZ / INSTANTS
        equation = [UM_PER_V2 * NATURAL_1_S**2], [1.0, 2.0 * DAMPING_RATIO * NATURAL_1_S, NATURAL_1_S**2]
        _, moved, _ = lsim(equation, np.repeat(drive**2, INSTANTS), t, interp=False)
        reading = moved[::INSTANTS] + 0.004 * rng.standard_normal(SAMPLES)
        records.append((drive, reading, use))
    return write_records(tmp_path, records, RATE_HZ, UNITS, more='hold = "zero"')


def test_a_model_that_no_segment_can_be_fitted_to_is_told_as_not_to_be_trusted(comb: Path) -> None:
    fit = rtctl.identify(comb)
    assert not fit.trusted


def test_its_square_is_named(comb: Path) -> None:
    found = rtctl.diagnose(
        comb, mechanisms="drive.harmonics,stiffness.cubic,stiffness.quadratic,drive.saturation"
    )
    assert [cause.id for cause in found.causes] == ["drive.harmonics"]
    assert found.verdict == "explained"
    gain = found.to_dict()["gain"]
    assert gain["after"] < 1.1 * gain["noise_floor"]
