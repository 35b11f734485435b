"""What struck a device late in a record is not cut off as "another course": no short segment of it is followed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, dataset_of, device, measured, noise_drive, problem_of
from test_diagnosis_predictability import WELLS, record_of

from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit, fit_nominal
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.search.record_parts.discarded_evidence import misses_more_beyond, restore_evidence
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

SAMPLES, STRUCK = 3000, 2600
RATE = 126.3
"""Angular frequency of the device [1/s]."""


@pytest.fixture(scope="module")
def struck(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """A record near whose end something gives the device a blow of five times its usual motion."""
    drive = noise_drive(5, samples=SAMPLES)
    reading = measured(device(), drive)
    late_s = PERIOD_S * np.arange(SAMPLES - STRUCK)
    reading[STRUCK:] += 7.0 * reading.std() * np.exp(-4.0 * late_s) * np.sin(RATE * late_s)
    return problem_of(dataset_of(tmp_path_factory.mktemp("struck"), (drive, reading, "fit")))


def test_the_end_of_a_record_that_the_model_leaves_is_judged_with_the_rest(struck: Problem) -> None:
    first = fit_nominal(struck, device(), lambda text: None)
    assert first.parted
    assert first.problem.samples < SAMPLES
    found = restore_evidence(first, ("friction.coulomb",), 0.05)
    assert found.uncut
    assert not found.parted
    assert found.problem.samples == SAMPLES
    assert not any("up to there" in note for note in found.notes)


def test_parts_that_show_what_is_wrong_stay(struck: Problem) -> None:
    first = fit_nominal(struck, device(), lambda text: None)
    assert restore_evidence(first, ("friction.coulomb",), 0.9999999) is first


def test_what_takes_another_course_and_is_followed_from_any_state_is_not_evidence() -> None:
    """Between two wells the right model parts from a record, and follows every short segment of it."""
    plant = device(**WELLS)
    drives = {seed: noise_drive(seed, level=4.0, samples=4000) for seed in (1, 2)}
    records = tuple(record_of(plant, seed, drive) for seed, drive in drives.items())
    whole = Problem(
        subject=subject_of("oscillator"), records=records, scales=estimate_scales(records), steps_per_period=64.0
    )  # fmt: skip
    parts = replace(whole, records=tuple(one.truncate(1500) for one in records))
    nearly = fit_hypothesis(
        parts, device(**{**WELLS, "stiffness_cubic": (30.01, "1/(mm^2*s^2)")}), (), iterations=0
    )
    assert nearly is not None
    first = NominalFit(parts, nearly, (whole, nearly), (), parted=True)
    assert not misses_more_beyond(first, whole)
    late = tuple(with_a_blow(one, 3000) for one in records)
    assert misses_more_beyond(first, replace(whole, records=late))


def with_a_blow(record: FitRecord, at: int) -> FitRecord:
    reading = record.measured["displacement"].copy()
    late_s = PERIOD_S * np.arange(len(reading) - at)
    reading[at:] += reading.std() * np.exp(-4.0 * late_s) * np.sin(RATE * late_s)
    return replace(record, measured={"displacement": reading})
