"""Spikes are replaced and said; steps, impacts that ring, and noise are left alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import FloatArray, answer_to, device, measured, noise_drive

from rtctl.diagnosis.screening.spikes import find_spikes, replace_drive_spikes
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.measured.dataset import Record

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


@pytest.mark.parametrize("size", [40.0, 9999.0])
@pytest.mark.parametrize("is_felt", [False, True])
def test_a_spike_of_the_drive_is_replaced_where_the_device_did_not_feel_it(
    size: float, is_felt: bool
) -> None:
    drive = noise_drive(3)
    sent = np.where(np.arange(len(drive)) == 700, size * np.abs(drive).max(), drive)
    response = measured(device(), sent if is_felt else drive)
    record = Record(
        name="r", file="", period_s=1e-3, use="fit", signals={"drive": sent, "displacement": response}
    )
    kept = replace_drive_spikes([record], "drive", "displacement", {"drive": "V"}, ScreeningThresholds())
    assert (kept.records[0].signals["drive"][700] == sent[700]) == is_felt
    assert [note for note in kept.notes if "taken as misread" in note] == list(kept.notes)
    assert len(kept.notes) == (0 if is_felt else 1)


def test_a_spike_of_the_drive_that_may_be_either_is_kept_and_told() -> None:
    drive = noise_drive(3)
    sent = np.where(np.arange(len(drive)) == 700, 40.0 * np.abs(drive).max(), drive)
    noise = np.random.default_rng(1).standard_normal(len(drive))  # of another device
    record = Record(
        name="r", file="", period_s=1e-3, use="fit", signals={"drive": sent, "displacement": noise}
    )
    kept = replace_drive_spikes([record], "drive", "displacement", {"drive": "V"}, ScreeningThresholds())
    assert kept.records[0] is record
    assert [
        note for note in kept.notes if "the response does not show if the device felt them, so" in note
    ] == list(kept.notes)
    assert len(kept.notes) == 1


def test_an_impulse_as_the_only_drive_is_kept() -> None:
    sent = np.where(np.arange(4000) == 700, 50.0, 0.0)
    record = Record(
        name="r",
        file="",
        period_s=1e-3,
        use="fit",
        signals={"drive": sent, "displacement": measured(device(), sent)},
    )
    kept = replace_drive_spikes([record], "drive", "displacement", {}, ScreeningThresholds())
    assert kept.records[0] is record
    assert not kept.notes


def test_a_misread_drive_is_no_cause(tmp_path: Path) -> None:
    """Without it a drive of 9999 V among some volts is explained by a saturation and harmonics of the drive."""
    records = [
        (noise_drive(k), measured(device(), noise_drive(k)), use) for k, use in ((1, "fit"), (2, "test"))
    ]
    records[0][0][700] = 9999.0
    found = answer_to(tmp_path, records)
    assert found["verdict"] == "adequate"
    assert any("of the drive are spikes" in warning for warning in found["warnings"])
