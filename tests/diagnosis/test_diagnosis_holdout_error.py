"""The error on test records is the model's: neither the noise of a first sample nor a fit's luck counts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import FRICTION, NOISE_MM, PERIOD_S, device, measured, noise_drive

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.search.holdout_error import ScoredOutput, compute_free_run_error, measure_gain
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import fit_noise

READING = ScoredOutput("displacement", "mm", NOISE_MM)


def record_of(seed: int, wrong_start_mm: float = 0.0) -> FitRecord:
    """Of the device with friction; its first reading is wrong by so much."""
    drive = noise_drive(seed)
    reading = measured(device(FRICTION), drive)
    reading[0] += wrong_start_mm
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])},
    )  # fmt: skip
    return FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}, first=1)


def test_a_wrong_first_reading_does_not_count_against_the_true_model() -> None:
    error = compute_free_run_error(device(FRICTION), record_of(4, wrong_start_mm=0.2), "displacement")
    assert float(np.sqrt(np.mean(error**2))) == pytest.approx(NOISE_MM, rel=0.1)


def test_the_ratio_is_of_the_two_errors_and_lies_in_its_interval() -> None:
    found = measure_gain(device(), device(FRICTION), [record_of(5), record_of(6)], READING, 126.0)
    assert found is not None
    assert found.ratio == pytest.approx(found.before / found.after)
    assert found.ratio_low < found.ratio < found.ratio_high
    assert found.after == pytest.approx(NOISE_MM, rel=0.1)


def test_without_test_records_there_is_no_gain_and_a_diverging_model_has_an_infinite_error() -> None:
    assert measure_gain(device(), device(FRICTION), [], READING, 126.0) is None
    wild = device(
        {"id": "stiffness.quadratic", "parameters": {"coefficient": {"value": 1e9, "unit": "1/(mm*s^2)"}}}
    )
    assert math.isinf(float(np.mean(compute_free_run_error(wild, record_of(4), "displacement") ** 2)))


def test_a_model_that_no_sensible_step_resolves_at_a_records_amplitude_has_an_infinite_error_too() -> None:
    stiff = {
        "id": "stiffness.quintic",
        "parameters": {"coefficient": {"value": 1e30, "unit": "1/(mm^4*s^2)"}},
    }
    error = compute_free_run_error(device(stiff), record_of(4), "displacement")
    assert np.isinf(error).all()


def test_what_each_record_has_for_itself_is_fitted_to_a_test_record_too() -> None:
    """The phase of a hum at a record's first sample says nothing of another record's."""

    def humming(cosine: float, sine: float) -> Simulation:
        mains = {"cosine": {"value": cosine, "unit": "mm"}, "sine": {"value": sine, "unit": "mm"}}
        return device(
            {"id": "sensor.hum", "parameters": mains | {"frequency": {"value": 50.0, "unit": "Hz"}}}
        )

    drive = noise_drive(9)
    reading = measured(humming(0.05, -0.1), drive)
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])},
    )  # fmt: skip
    record = FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}, first=1)
    for within in (1.0, 0.5):
        error = compute_free_run_error(humming(-0.08, 0.02), record, "displacement", within)
        assert len(error) == len(reading) - 1
        assert float(np.sqrt(np.mean(error**2))) == pytest.approx(NOISE_MM, rel=0.1)


def test_a_motion_begins_where_the_models_sensor_reads_its_first_sample() -> None:
    """Of a beam with two wells, 7.3 mm either way, whose sensor reads 8 mm too much: in the right one."""
    wells = {
        "stiffness": (-1.6e3, "1/s^2"),
        "stiffness_cubic": (30.0, "1/(mm^2*s^2)"),
        "damping": (3.0, "1/s"),
    }
    off = {"id": "sensor.offset", "parameters": {"offset": {"value": 8.0, "unit": "mm"}}}
    drive = noise_drive(8, level=0.5)
    for well in (7.3, -7.3):
        plant = device(off, **wells)
        stimulus = Stimulus(
            inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
            initial={"displacement": well + 8.0}, read=frozenset({"displacement"}),
        )  # fmt: skip
        values = np.array([one.value for one in plant.parameters])
        reading = plant.predict(stimulus, values, np.array([[well, 0.0]])).outputs["displacement"][0]
        record = FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}, first=1)
        assert np.abs(compute_free_run_error(plant, record, "displacement")).max() < 1e-6


def test_a_fast_effect_beside_a_slow_error_of_the_model_shows_in_units_of_the_noise() -> None:
    """The record has friction and, as a static model errs, something slow that is far larger."""
    record = record_of(5)
    slow = 600.0 * NOISE_MM * np.sin(np.linspace(0.0, 12.0, record.samples))
    record = replace(record, measured={"displacement": record.measured["displacement"] + slow})
    noise = fit_noise([slow + NOISE_MM * np.random.default_rng(1).normal(size=len(slow))])
    plain = measure_gain(device(), device(FRICTION), [record], READING, 126.0)
    whitened = measure_gain(device(), device(FRICTION), [record], READING._replace(noise=noise), 126.0)
    assert plain is not None
    assert whitened is not None
    assert plain.ratio < 1.2
    assert whitened.ratio_low > 1.3
