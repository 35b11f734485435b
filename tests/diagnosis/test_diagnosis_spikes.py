"""Spikes are replaced and said; steps, impacts that ring, and noise are left alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import FloatArray, answer_to, device, measured, noise_drive

from rtctl.diagnosis.screening.spikes import find_spikes

RNG = np.random.default_rng(5)
MOTION = np.sin(0.3 * np.arange(2000)) + 0.01 * RNG.standard_normal(2000)
STEPS = np.repeat(RNG.uniform(10.0, 300.0, 20), 100) + 0.1 * RNG.standard_normal(2000)
RINGING = np.where(np.arange(2000) < 1900, 0.0, np.exp(-0.02 * (np.arange(2000) - 1900)) * MOTION)


def spiked(values: FloatArray, *at: int) -> FloatArray:
    return np.where(np.isin(np.arange(len(values)), at), values + 50.0 * np.ptp(values), values)


@pytest.mark.parametrize("values", [MOTION, STEPS])
@pytest.mark.parametrize("at", [(700,), (0, 1999), (100, 101, 900)])
def test_spikes_are_found(values: FloatArray, at: tuple[int, ...]) -> None:
    assert find_spikes(spiked(values, *at)).tolist() == list(at)


@pytest.mark.parametrize(
    "values",
    [
        MOTION, STEPS, RINGING, RINGING + 1e-4 * RNG.standard_normal(2000), RNG.standard_normal(2000),
        RNG.standard_t(3, 2000), np.round(20.0 * MOTION) / 20.0, np.zeros(2000), np.ones(3),
        spiked(MOTION, 700, 701, 702, 703), spiked(MOTION, *range(0, 2000, 20)),
    ],
)  # fmt: skip
def test_what_may_be_a_motion_or_noise_is_left_alone(values: FloatArray) -> None:
    assert len(find_spikes(values)) == 0


@pytest.mark.parametrize("side", [1, -1])
def test_a_warm_up_and_a_cooling_begin_without_a_spike(side: int) -> None:
    """A film that is quick at first and then at rest for long: its first reading is far from all others."""
    reading = 1.2e4 + 1.5e5 * np.exp(-np.arange(4000) / 0.8) + np.random.default_rng(1).normal(0.0, 1.0, 4000)
    assert len(find_spikes(reading[::side])) == 0


def test_a_reading_of_a_million_costs_a_note_and_no_verdict(tmp_path: Path) -> None:
    records = [
        (noise_drive(k), measured(device(), noise_drive(k)), use) for k, use in ((1, "fit"), (2, "test"))
    ]
    records[0][1][700] = 1e6
    found = answer_to(tmp_path, records)
    assert found["verdict"] == "adequate"
    assert any("1e+06 mm in sample 700" in warning for warning in found["warnings"])
