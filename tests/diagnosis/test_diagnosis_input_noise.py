"""Noise that an instrument adds to the recorded input is told as such, and is no sign of a wrong model."""

from __future__ import annotations

import re
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import FRICTION, answer_to, dataset_of, device, fit_of, measured, noise_drive, problem_of
from numpy.typing import NDArray

from rtctl.diagnosis.residual import residual_tests
from rtctl.diagnosis.residual.input_noise import separate_noise
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests

IDS = ("stiffness.cubic", "damping.quadratic", "friction.coulomb", "friction.stribeck")
NOISE_V = 0.012
SAMPLES = 3000
Record = tuple[NDArray[np.float64], NDArray[np.float64], str]


def steps(seed: int) -> NDArray[np.float64]:
    """Levels that are held for a second, in which the device comes to rest [V]."""
    levels = np.random.default_rng(seed).uniform(-8.0, 8.0, SAMPLES // 500)
    return np.repeat(levels, 500)


def records(*hidden: dict[str, object], felt: bool = False) -> list[Record]:
    """Of a well damped device whose drive is recorded with noise, or which feels that noise."""
    plant, made = device(*hidden, damping=(60.0, "1/s")), []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = noise_drive(seed, 6.0, SAMPLES) if use == "test" else steps(seed)
        read = drive + NOISE_V * np.random.default_rng(100 + seed).standard_normal(SAMPLES)
        made.append((read, measured(plant, read if felt else drive, 0.0004), use))
    return made


def passed_through(folder: Path, *, felt: bool) -> TestedHypothesis:
    """The right model's residual tests."""
    problem = problem_of(dataset_of(folder, *records(felt=felt)))
    return run_residual_tests(fit_of(problem), problem, IDS)


def test_a_right_model_passes_and_the_noise_is_known(tmp_path: Path) -> None:
    found = passed_through(tmp_path, felt=False)
    assert found.p_value > 0.01
    assert found.input_noise is not None
    assert found.input_noise.share * found.input_noise.rms == pytest.approx(NOISE_V, rel=0.4)


def test_a_right_model_would_fail_with_the_noise_in_its_residual(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(residual_tests, "find_input_noise", lambda analysis: None)
    assert passed_through(tmp_path, felt=False).p_value < 1e-6


def test_noise_that_the_device_felt_is_not_told(tmp_path: Path) -> None:
    assert passed_through(tmp_path, felt=True).input_noise is None


def test_friction_that_is_not_in_the_model_is_not_hidden_by_it(tmp_path: Path) -> None:
    problem = problem_of(dataset_of(tmp_path, *records(FRICTION)))
    assert run_residual_tests(fit_of(problem), problem, IDS).p_value < 1e-6


def test_the_diagnosis_says_that_nothing_is_wrong_and_how_large_the_noise_is(tmp_path: Path) -> None:
    found = answer_to(tmp_path, records(), "stiffness.cubic,friction.coulomb")
    assert found["verdict"] == "adequate"
    (told,) = [one for one in found["warnings"] if "did not feel" in one]
    assert re.search(r"the recorded drive holds noise of 0\.0(09|1)\d* V \(RMS\) or more", told)


def test_noise_is_separated_from_steps() -> None:
    clean, noise = steps(4), NOISE_V * np.random.default_rng(9).standard_normal(SAMPLES)
    found = separate_noise(clean + noise)
    assert np.corrcoef(found, noise)[0, 1] > 0.75
    assert separate_noise(clean).std() < 0.1 * NOISE_V


def test_constant_and_short_inputs_hold_no_noise() -> None:
    assert not separate_noise(np.random.default_rng(1).standard_normal(100)).any()
    assert not separate_noise(np.zeros(5000)).any()
    assert separate_noise(np.full(5000, 3.0)).std() < 1e-12
    assert separate_noise(np.empty(0)).size == 0


def blows(seed: int) -> NDArray[np.float64]:
    """Blows of an impact hammer, two samples wide, with nothing between them [V]."""
    random, drive = np.random.default_rng(seed), np.zeros(SAMPLES)
    for at in range(60, SAMPLES - 500, 700):
        drive[at + random.integers(0, 40) + np.arange(5)] = (
            random.uniform(30.0, 50.0) * np.sin(np.pi * np.arange(1, 6) / 6.0) ** 2
        )
    return drive


def test_a_hammer_whose_cell_is_noisy_has_no_dead_zone(tmp_path: Path) -> None:
    """A dead zone would silence the noise between the blows, which the device never felt."""
    plant, made = device(damping=(6.0, "1/s")), []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        struck = blows(seed)
        read = struck + 0.03 * np.random.default_rng(200 + seed).standard_normal(SAMPLES)
        made.append((read, measured(plant, struck, 0.0004), use))
    found = answer_to(tmp_path, made, "drive.deadband,friction.coulomb,damping.quadratic")
    assert (found["verdict"], found["causes"]) == ("adequate", [])
    assert any("it is taken off the drive here" in note for note in found["warnings"]), found["warnings"]


def test_a_finding_stays_one_where_no_noise_was_taken_off(tmp_path: Path) -> None:
    """Also where the residual is below the noise that it was told to have: all tests were passed then."""
    problem = problem_of(dataset_of(tmp_path, *records(FRICTION)))
    tested = run_residual_tests(fit_of(problem), problem, IDS)
    projected = copy(tested.projected)
    projected.residual = 0.0
    small = tested._replace(projected=projected)
    assert tested.p_value < 1e-6
    assert residual_tests._without_drive_noise(small, problem).p_value == tested.p_value
    taken = replace(problem, taken_off=0.5)
    assert residual_tests._without_drive_noise(small, taken).p_value == 1.0
