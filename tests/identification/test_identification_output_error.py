"""Output error finds parameters to the accuracy that it states, from every kind of data that can give them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from oscillator_cases import DUFFING, free_values, multisine, oscillator, record_of, tone
from scipy.optimize import least_squares
from scipy.signal import lfilter

from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.start_values import generate_starts
from rtctl.identification.simulation_error.output_error import FitOptions, fit_output_error
from rtctl.identification.simulation_error.sensitivity import Sensitivity

FloatArray = NDArray[np.float64]
ONE_THREAD = FitOptions(threads=1)


def fit_from_two_percent_off(record: FitRecord) -> Fit:
    simulation = oscillator(DUFFING)
    return fit_output_error(simulation, [record], ONE_THREAD, starts=[1.02 * free_values(simulation)])


@pytest.mark.parametrize(("noise_db", "claimed"), [(30.0, 0.0012), (0.0, 0.039)])
def test_a_tone_from_rest_gives_the_resonators_damping(noise_db: float, claimed: float) -> None:
    # the ME resonator: 7.5 kHz, here Q 1000, one second at 125 kHz; its start is known
    values = {"damping": 47.0, "stiffness": 2.22e9, "stiffness_cubic": 0.0, "drive_gain": 1000.0}
    simulation = oscillator(values)
    drive = tone(7500.0, 1.0, 125e3, 1.0)
    clean = record_of(simulation, drive, 125e3, 0.0, seed=0).measured["displacement"]
    noise = float(np.std(clean)) * 10.0 ** (-noise_db / 20.0)
    record = record_of(simulation, drive, 125e3, noise, seed=31)
    free = [0, 1, 3]
    known = FitOptions(free_start=False)
    fit = fit_output_error(simulation, [record], known, starts=[1.001 * free_values(simulation)], free=free)
    assert fit.standard_errors[0] < claimed * values["damping"]
    assert abs(fit.values[0] - values["damping"]) < 4.0 * fit.standard_errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_ninety_five_percent_intervals_hold_the_truth_in_95_of_100_fits(colour: float) -> None:
    simulation = oscillator(DUFFING)
    truth = free_values(simulation)
    drive = multisine(5.0, 30.0, 2.0, 400.0, 3.0, seed=8)
    clean = record_of(simulation, drive, 400.0, 0.0, seed=0)
    inside = np.zeros(len(truth))
    for seed in range(100):
        white = np.random.default_rng(1000 + seed).standard_normal(clean.samples + 100)
        noise = 0.02 * lfilter([1.0], [1.0, -colour], white)[100:]
        noisy = {"displacement": clean.measured["displacement"] + noise}
        record = FitRecord(name="r", stimulus=clean.stimulus, measured=noisy)
        fit = fit_output_error(simulation, [record], ONE_THREAD)
        inside += np.abs(fit.values - truth) < 1.96 * fit.standard_errors
    # binomial: 95 +- 2.2; four parameters, so three standard deviations
    assert (inside >= 95 - 3 * 2.2).all(), inside


def test_scipy_finds_the_same_minimum() -> None:
    simulation = oscillator(DUFFING)
    truth = free_values(simulation)
    record = record_of(simulation, multisine(5.0, 30.0, 2.0, 400.0, 3.0, seed=9), 400.0, 0.05, seed=9)
    ours = fit_output_error(simulation, [record], FitOptions(threads=1, free_start=False))

    def residual(scaled: FloatArray) -> FloatArray:
        run = simulation.predict(record.stimulus, scaled * truth)
        return run.outputs["displacement"][0] - record.measured["displacement"]

    theirs = least_squares(residual, np.ones(4), x_scale=0.01, xtol=1e-12, ftol=1e-14)
    assert ours.values == pytest.approx(
        theirs.x * truth, abs=0.02 * float(ours.standard_errors.min()), rel=1e-6
    )


def test_derivatives_are_those_of_central_differences() -> None:
    simulation = oscillator(DUFFING)
    record = record_of(simulation, multisine(5.0, 30.0, 2.0, 400.0, 2.0, seed=10), 400.0, 0.0, seed=10)
    sensitivity = Sensitivity.of(simulation, [record])
    shared = free_values(simulation) / sensitivity.scale
    start = np.zeros(2)
    found = sensitivity.linearise(record, shared, start)
    assert found is not None
    for k in range(4):
        nudge = np.zeros(4)
        nudge[k] = 1e-4 * shared[k]
        above = sensitivity.linearise(record, shared + nudge, start)
        below = sensitivity.linearise(record, shared - nudge, start)
        assert above is not None
        assert below is not None
        slope = (above.residual - below.residual) / (2.0 * nudge[k])
        assert np.abs(found.shared[k] - slope).max() < 1e-4 * np.abs(slope).max()


def test_a_start_that_diverges_is_passed_over_and_alone_it_is_said() -> None:
    simulation = oscillator(DUFFING)
    truth = free_values(simulation)
    unbounded = np.array([0.0, -8882.6, -4e4, 1000.0])
    record = record_of(simulation, tone(14.0, 2.0, 400.0, 3.0), 400.0, 0.02, seed=12)
    fit = fit_output_error(simulation, [record], ONE_THREAD, starts=[unbounded, 1.05 * truth])
    assert fit.values == pytest.approx(truth, rel=0.05)
    with pytest.raises(FitError, match="diverges from every start"):
        fit_output_error(simulation, [record], ONE_THREAD, starts=[unbounded])


def test_samples_that_start_the_state_are_not_fitted() -> None:
    simulation = oscillator(DUFFING)
    record = record_of(simulation, multisine(5.0, 30.0, 2.0, 400.0, 4.0, seed=13), 400.0, 0.02, seed=13)
    spoiled = record.measured["displacement"].copy()
    spoiled[:20] += 5.0
    ignoring = FitRecord(name="r", stimulus=record.stimulus, measured={"displacement": spoiled}, first=20)
    fit = fit_from_two_percent_off(ignoring)
    assert (np.abs(fit.values - free_values(simulation)) < 4.0 * fit.standard_errors).all()


def test_a_measured_velocity_is_weighed_by_its_own_noise() -> None:
    simulation = oscillator(DUFFING)
    drive = multisine(5.0, 30.0, 2.0, 400.0, 4.0, seed=14)
    alone = record_of(simulation, drive, 400.0, 0.05, seed=14)
    both = record_of(simulation, drive, 400.0, 0.05, seed=14, velocity_noise=1.0)
    one, two = fit_from_two_percent_off(alone), fit_from_two_percent_off(both)
    assert two.rms["velocity"] == pytest.approx(1.0, rel=0.1)
    assert (two.standard_errors < 0.6 * one.standard_errors).all()
    assert (np.abs(two.values - free_values(simulation)) < 4.0 * two.standard_errors).all()


def test_records_of_unknown_start_share_parameters_and_keep_their_own_states() -> None:
    simulation = oscillator(DUFFING)
    starts = [(2.0, 0.0), (-1.0, 150.0), (0.0, -200.0)]
    records = [
        record_of(
            simulation, multisine(5.0, 30.0, 1.0, 400.0, 3.0, seed=k), 400.0, 0.02, seed=50 + k, initial=start,
            name=f"r{k}",
        )
        for k, start in enumerate(starts)
    ]  # fmt: skip
    found = generate_starts(simulation, records, 2, seed=0, trust_own=False)
    fit = fit_output_error(simulation, records, starts=found.values)
    assert (np.abs(fit.values - free_values(simulation)) < 4.0 * fit.standard_errors).all()
    assert fit.initial == pytest.approx(np.array(starts), abs=2.0)


def test_a_parameter_stays_within_its_bounds() -> None:
    undamped = oscillator({**DUFFING, "damping": 0.0, "stiffness_cubic": 0.0})
    record = record_of(undamped, np.zeros(1200), 400.0, 0.01, seed=3, initial=(3.0, 0.0))
    swelling = {"displacement": record.measured["displacement"] * np.linspace(0.7, 1.3, record.samples)}
    growing = FitRecord(name="r", stimulus=record.stimulus, measured=swelling)
    fit = fit_output_error(undamped, [growing], ONE_THREAD, free=[0, 1])
    assert fit.values[0] == 0.0
    assert fit.values[1] == pytest.approx(DUFFING["stiffness"], rel=1e-2)
