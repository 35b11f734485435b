"""A low-pass filter that a user applied to the response alone: no cause stands for it, so it is told."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, noise_drive
from scipy.signal import butter, sosfiltfilt

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.filtered_readings import describe_filters
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

FILTER = butter(4, 60.0, fs=1.0 / PERIOD_S, output="sos")


def problem_of(drive: FloatArray, reading: FloatArray) -> Problem:
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}),)
    return Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )


def readings(noise: float) -> tuple[FloatArray, FloatArray]:
    plant = device()
    drive = np.tile(noise_drive(1), 2)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    values = np.array([one.value for one in plant.parameters])
    z = plant.predict(stimulus, values).outputs["displacement"][0]
    return drive, z + noise * z.std() * np.random.default_rng(3).standard_normal(len(z))


@pytest.mark.parametrize("noise", [1e-3, 0.03])
def test_a_filter_of_the_response_alone_is_told(noise: float) -> None:
    drive, z = readings(noise)
    (said,) = describe_filters(problem_of(drive, sosfiltfilt(FILTER, z)))
    assert "of the displacement falls by" in said
    assert "Hz, and that of the drive does not" in said


@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.03])
def test_readings_as_they_are_and_both_signals_filtered_are_not(noise: float) -> None:
    drive, z = readings(noise)
    assert describe_filters(problem_of(drive, z)) == []
    assert describe_filters(problem_of(sosfiltfilt(FILTER, drive), sosfiltfilt(FILTER, z))) == []


def test_a_short_record_and_one_without_a_drive_say_nothing() -> None:
    drive, z = readings(0.01)
    assert describe_filters(problem_of(drive[:500], sosfiltfilt(FILTER, z)[:500])) == []
    assert describe_filters(problem_of(np.zeros(len(z)), sosfiltfilt(FILTER, z))) == []
