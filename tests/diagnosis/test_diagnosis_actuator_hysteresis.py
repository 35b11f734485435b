"""A hysteretic actuator is named, with plays that are integrated here, and is not taken for a spring or friction."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import write_records
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import rtctl

RATE_HZ = 4000.0
SAMPLES = 4000
NATURAL_HZ, QUALITY, GAIN_UM_V = 240.0, 20.0, 0.12
NOISE_UM = 0.02
UNITS = {"drive": "V", "displacement": "um"}
FEW = (
    "actuator.hysteresis,actuator.backlash,hysteresis.bouc_wen,friction.presliding,stiffness.viscoelastic,"
    "drive.harmonics,drive.lag"
)


def tones(seed: int, highest_hz: float, level_v: float) -> NDArray[np.float64]:
    """A drive of four tones [V], from rest."""
    rng, t = np.random.default_rng(seed), np.arange(SAMPLES) / RATE_HZ
    drive = sum(
        np.sin(2.0 * np.pi * f * t + phase)
        for f, phase in zip(rng.uniform(2.0, highest_hz, 4), rng.uniform(0.0, 6.0, 4), strict=True)
    )
    scaled: NDArray[np.float64] = level_v * np.minimum(1.0, t / 0.05) * drive / np.abs(drive).max()
    return scaled


def stage(
    drive: NDArray[np.float64], thresholds: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Displacement [um] of a stage behind plays of these thresholds [V]; the drive is linear between samples."""
    play, acts = np.zeros(len(thresholds)), []
    for one in drive:
        play = np.clip(play, one - thresholds, one + thresholds)
        acts.append(one + weights @ play)
    t, rate = np.arange(SAMPLES) / RATE_HZ, 2.0 * math.pi * NATURAL_HZ

    def rates(time: float, y: NDArray[np.float64]) -> list[float]:
        force = GAIN_UM_V * np.interp(time, t, acts)
        return [y[1], rate * rate * (force - y[0]) - rate / QUALITY * y[1]]

    solved = solve_ivp(
        rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-6, atol=1e-6, max_step=0.5 / RATE_HZ
    )
    noise = NOISE_UM * np.random.default_rng(len(acts)).standard_normal(SAMPLES)
    found: NDArray[np.float64] = solved.y[0] + noise
    return found


@pytest.mark.parametrize("fading", [0.0, 0.04], ids=["even", "fading"])
def test_a_piezo_stage_is_named_by_its_hysteresis(fading: float, tmp_path: Path) -> None:
    thresholds = np.linspace(0.0, 50.0, 51)[1:]
    weights = 0.005 * np.exp(-fading * thresholds)
    kinds = ((20.0, 45.0, "fit"), (120.0, 30.0, "fit"), (60.0, 40.0, "test"))
    drives = [(tones(k, highest, level), use) for k, (highest, level, use) in enumerate(kinds)]
    records = [(drive, stage(drive, thresholds, weights), use) for drive, use in drives]
    manifest = write_records(tmp_path, records, RATE_HZ, UNITS)
    found = rtctl.diagnose(manifest, mechanisms=FEW)
    (cause,) = found.causes
    assert cause.id == "actuator.hysteresis"
    assert found.verdict == "explained"
    assert cause.parameters["density"].value == pytest.approx(0.005, rel=0.05)
    assert cause.parameters["fading"].value == pytest.approx(fading, abs=0.006)
