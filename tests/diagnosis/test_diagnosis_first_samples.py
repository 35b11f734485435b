"""Sets that obviously fail are tested on the first samples of long records, and all others on every sample."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import FRICTION, device, fit_of, measured, noise_drive, problem_of, write_case

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.first_samples import run_search_tests
from rtctl.measured import read_dataset

SAMPLES, FIRST = 8_000, 2_000
CUBIC: dict[str, object] = {
    "id": "stiffness.cubic",
    "parameters": {"coefficient": {"value": 2e4, "unit": "1/(mm^2*s^2)"}},
}
IDS = ("friction.coulomb", "damping.quadratic")


def problem_with(folder: Path, drive: FloatArray, law: dict[str, object] = FRICTION) -> Problem:
    """A device with `law` under `drive`, whose sets are tested on the first `FIRST` samples first."""
    manifest = write_case(folder, [(drive, measured(device(law), drive), "fit")])
    problem = problem_of(read_dataset(manifest))
    limits = replace(problem.thresholds.residual, first_samples=FIRST)
    return replace(problem, thresholds=replace(problem.thresholds, residual=limits))


@pytest.mark.parametrize(("mechanisms", "tested"), [((), FIRST), (("friction.coulomb",), SAMPLES)])
def test_only_what_fails_is_tested_on_few_samples(
    tmp_path: Path, mechanisms: tuple[str, ...], tested: int
) -> None:
    problem = problem_with(tmp_path, noise_drive(1, samples=SAMPLES))
    found = run_search_tests(fit_of(problem, *mechanisms), problem, IDS)
    assert found.projected.samples == pytest.approx(tested, rel=0.01)
    assert (found.p_value > 0.01) == (tested == SAMPLES)


def test_first_samples_that_show_less_than_the_others_are_not_enough(tmp_path: Path) -> None:
    """A motion that grows: of a spring that hardens, too little is seen at first to tell how, but it is seen."""
    growing = noise_drive(1, samples=SAMPLES) * np.linspace(0.1, 1.0, SAMPLES)
    problem = problem_with(tmp_path, growing, CUBIC)
    found = run_search_tests(fit_of(problem), problem, IDS)
    assert found.projected.samples == pytest.approx(SAMPLES, rel=0.01)
    assert found.p_value < 1e-6
