"""Chaotic and bistable motion: shooting finds what a free run loses, and it is said why it was taken."""

from __future__ import annotations

import numpy as np
import pytest
from oscillator_cases import DUFFING, HM, beam_records, free_values, multisine, oscillator, record_of

from rtctl.identification.fit import Fit
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.start_values import generate_starts
from rtctl.identification.simulation_error.multiple_shooting import fit_multiple_shooting
from rtctl.identification.simulation_error.output_error import fit_output_error
from rtctl.identification.simulation_error.trajectory_divergence import measure_divergence


@pytest.fixture(scope="module")
def chaos() -> list[FitRecord]:
    """The paper's beam between 11.75 and 14.5 Hz, 100 um of noise."""
    return beam_records(
        oscillator(HM),
        [(12.5, 5.0), (13.0, -6.0)],
        noise_mm=0.1,
        seed=61,
        sample_rate_hz=1e3,
        duration_s=10.0,
    )


@pytest.fixture(scope="module")
def shot(chaos: list[FitRecord]) -> Fit:
    simulation = oscillator(HM)
    starts = generate_starts(simulation, chaos, 1, seed=0, trust_own=False)
    return fit_multiple_shooting(simulation, chaos, starts=starts.values)


def test_runs_of_the_beam_part_and_runs_in_one_well_do_not(chaos: list[FitRecord]) -> None:
    beam = oscillator(HM)
    parts = measure_divergence(beam, chaos, free_values(beam))
    assert parts.is_chaotic
    assert 0.5 < parts.rate < 20.0  # a few per second
    duffing = oscillator(DUFFING)
    record = record_of(duffing, multisine(5.0, 30.0, 2.0, 1e3, 10.0, seed=62), 1e3, 0.0, seed=62)
    assert not measure_divergence(duffing, [record], free_values(duffing)).is_chaotic


@pytest.mark.slow
def test_shooting_finds_the_beams_parameters_within_its_stated_errors(shot: Fit) -> None:
    truth = free_values(oscillator(HM))
    assert (np.abs(shot.values - truth) < 4.0 * shot.standard_errors).all()
    assert (shot.standard_errors < 0.02 * np.abs(truth)).all()
    assert shot.rms["displacement"] == pytest.approx(0.1, rel=0.05)


@pytest.mark.slow
def test_output_error_from_the_same_start_fails(chaos: list[FitRecord], shot: Fit) -> None:
    simulation = oscillator(HM)
    starts = generate_starts(simulation, chaos, 1, seed=0, trust_own=False)
    free_run = fit_output_error(simulation, chaos, starts=starts.values)
    assert free_run.rms["displacement"] > 20.0 * shot.rms["displacement"]
