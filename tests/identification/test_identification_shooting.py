"""Chaotic and bistable motion: shooting finds what a free run loses, and it is said why it was taken."""

from __future__ import annotations

import numpy as np
import pytest
from oscillator_cases import DUFFING, HM, beam_records, free_values, multisine, oscillator, record_of

from rtctl.identification.fit import Fit
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.start_values import generate_starts
from rtctl.identification.simulation_error import multiple_shooting, segments
from rtctl.identification.simulation_error.multiple_shooting import ShootingOptions, fit_multiple_shooting
from rtctl.identification.simulation_error.output_error import FitOptions, fit_output_error
from rtctl.identification.simulation_error.segments import SegmentCost
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


def test_several_starts_are_compared_by_some_segments_and_the_best_is_fitted_to_all(
    chaos: list[FitRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of long records most of the time went into starts that lose."""
    simulation, run = oscillator(HM), []
    starts = generate_starts(simulation, chaos, 4, seed=0, trust_own=False).values
    linearise = SegmentCost.linearise
    monkeypatch.setattr(SegmentCost, "linearise", lambda *given: run.append(1) or linearise(*given))
    found, runs = [], []
    for most in (10_000, 24):
        monkeypatch.setattr(multiple_shooting, "MOST_SCREENED", most)
        found.append(fit_multiple_shooting(simulation, chaos, ShootingOptions(gaps=()), starts=starts))
        runs.append(len(run))
        run.clear()
    assert found[1].values == pytest.approx(found[0].values, rel=1e-4)
    assert runs[1] < 0.6 * runs[0]


def test_segments_that_leave_too_much_by_themselves_are_not_joined(
    chaos: list[FitRecord], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hopeless model of 3,276 segments was pulled together for two minutes."""
    simulation, joined = oscillator(HM), []
    start = generate_starts(simulation, chaos, 1, seed=0, trust_own=False).values
    add = segments._add_continuity
    monkeypatch.setattr(segments, "_add_continuity", lambda *given: joined.append(1) or add(*given))
    few = FitOptions(iterations=1, final_iterations=1, screening_iterations=1)
    for most_left, are in ((1e-6, False), (10.0, True)):
        fit_multiple_shooting(simulation, chaos, ShootingOptions(most_left=most_left, fit=few), starts=start)
        assert bool(joined) == are


@pytest.mark.slow
def test_output_error_from_the_same_start_fails(chaos: list[FitRecord], shot: Fit) -> None:
    simulation = oscillator(HM)
    starts = generate_starts(simulation, chaos, 1, seed=0, trust_own=False)
    free_run = fit_output_error(simulation, chaos, starts=starts.values)
    assert free_run.rms["displacement"] > 20.0 * shot.rms["displacement"]
