"""Amplitude and phase from a lock-in's outputs, and the noise that the estimator learns of them."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.estimators.lock_in import MEMORY, LockInEstimator
from rtctl.interfaces import EstimateStatus


def run(readings: np.ndarray) -> list:
    estimator = LockInEstimator()
    first = estimator.start((0.0, 7500.0), (readings[0].real, readings[0].imag))
    return [
        first,
        *(estimator.step((0.0, 7500.0), (z.real, z.imag), 5e-4) for z in readings[1:]),
    ]


@settings(deadline=None)  # the first call compiles
@given(st.floats(1e-6, 10.0), st.floats(-3.1, 3.1))
def test_it_is_the_phasor_in_polar_form(amplitude: float, phase: float) -> None:
    z = cmath.rect(amplitude, phase)
    estimator = LockInEstimator()
    estimator.start((0.0, 7500.0), (0.0, 0.0))
    found = estimator.step((0.0, 7500.0), (z.real, z.imag), 5e-4)
    assert found.value == pytest.approx(amplitude)
    assert found.surrogate == pytest.approx(math.degrees(phase), abs=1e-9)


@pytest.mark.parametrize("turn_hz", [0.0, 100.0])
def test_the_standard_error_is_that_of_the_noise_also_while_the_phase_turns(turn_hz: float) -> None:
    count, sigma = 6000, 1e-4
    draw = np.random.default_rng(5)
    noise = sigma * (draw.standard_normal(count) + 1j * draw.standard_normal(count))
    z = 0.5 * np.exp(2j * np.pi * turn_hz * 5e-4 * np.arange(count)) + noise
    claimed = np.array([estimate.confidence for estimate in run(z)[25 * MEMORY :]])
    # mean of MEMORY squares that overlap in second differences: about 2.1 / sqrt(2 MEMORY) relative
    assert claimed.mean() == pytest.approx(sigma, rel=0.05)
    assert claimed.std() < 0.25 * sigma


def test_a_ramp_is_no_noise() -> None:
    z = -1j * np.linspace(0.1, 0.9, 30 * MEMORY)
    assert run(z)[-1].confidence < 1e-6


def test_the_first_reading_is_taken_for_noise() -> None:
    estimate = LockInEstimator().start((0.0, 7500.0), (3e-4, -4e-4))
    assert estimate.confidence == pytest.approx(5e-4 / math.sqrt(2.0))


def test_a_resonator_that_still_rings_is_not_taken_for_noise_for_long() -> None:
    z = -0.5j * np.exp(-0.01 * np.arange(12))
    claimed = [estimate.confidence for estimate in run(z)]
    assert claimed[0] > 0.3
    assert claimed[6] < 1e-3


def test_a_reading_that_is_no_number_holds_the_last_one_and_is_flagged() -> None:
    estimator = LockInEstimator()
    estimator.start((0.0, 7500.0), (0.0, -0.3))
    fresh = LockInEstimator()
    assert fresh.start((0.0, 7500.0), (math.nan, 0.1)).status == EstimateStatus.NOT_FINITE
    assert fresh.step((0.0, 7500.0), (0.3, 0.0), 5e-4) == LockInEstimator().start((0.0, 7500.0), (0.3, 0.0))
    estimate = estimator.step((0.0, 7500.0), (math.nan, -0.3), 5e-4)
    assert (estimate.value, estimate.status) == (0.3, EstimateStatus.NOT_FINITE)
