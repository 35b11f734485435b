"""Noise does not grow with the motion; a residual that does is a gap, and one that cannot is none."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, PERIOD_S, device, measured, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

SAMPLES, DRIVEN = 4000, 600


@pytest.mark.parametrize(("growing", "seen"), [(0.0, False), (0.02, True)])
def test_a_ring_down_that_ends_in_the_noise_is_no_growth(growing: float, seen: bool) -> None:
    """There the size of a reading is that of its own noise; the motion's is the simulation's."""
    records = []
    for seed in range(4):
        drive = noise_drive(seed, samples=SAMPLES)
        drive[DRIVEN:] = 0.0
        clean = measured(device(), drive, noise=0.0)
        spread = np.hypot(NOISE_MM, growing * clean)
        reading = clean + spread * np.random.default_rng([seed, 9]).standard_normal(SAMPLES)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        records.append(
            FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)
        )
    problem = Problem(
        subject=subject_of("oscillator"), records=tuple(records), scales=estimate_scales(tuple(records)),
        steps_per_period=64.0,
    )  # fmt: skip
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    tests = {
        test.name: test.p_value for test in run_residual_tests(nominal, problem, ("friction.coulomb",)).tests
    }
    assert (tests["residual grows with the motion"] < 1e-3) == seen
