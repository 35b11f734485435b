"""What struck a resonator late in a record is not cut off as "another course" where no motion can take one."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, dataset_of, device, measured, noise_drive, problem_of

from rtctl.diagnosis.nominal_fit.nominal_fit import fit_nominal
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.search.discarded_evidence import may_jump, restore_evidence

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


@pytest.mark.parametrize(
    ("cubic", "jumps"), [(0.0, False), (20.0, False), (-20.0, False), (800.0, True), (-800.0, True)]
)
def test_a_spring_jumps_by_its_shift_over_its_bandwidth(cubic: float, jumps: bool, struck: Problem) -> None:
    assert may_jump(device(stiffness_cubic=(cubic, "1/(mm^2*s^2)")), struck) == jumps


def test_two_wells_and_what_is_not_known_may_jump(struck: Problem) -> None:
    assert may_jump(device(stiffness=(-1.6e4, "1/s^2")), struck)
    assert may_jump(device().extended(("damping.quadratic",)), struck)
