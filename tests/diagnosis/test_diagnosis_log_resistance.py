"""The reading of a film's resistance: noise and relative errors are of one size from the insulator to the metal."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.plants.vo2.log_resistance import RELATIVE_ERROR, floor_of, log_above


def test_noise_and_relative_errors_weigh_alike_over_two_decades() -> None:
    draw, noise_ohm = np.random.default_rng(1), 150.0
    resistance = 10.0 ** np.linspace(3.3, 5.5, 4000)
    floor = floor_of([resistance + noise_ohm * draw.standard_normal(4000)])
    assert floor == pytest.approx(0.5 * noise_ohm / RELATIVE_ERROR, rel=0.1)
    assert RELATIVE_ERROR < 0.02  # else a metallic film's noise hides what lies along the resistance
    error = np.sqrt(noise_ohm**2 + (RELATIVE_ERROR * resistance) ** 2)
    size = log_above(resistance + error, floor) - log_above(resistance, floor)
    assert size == pytest.approx(np.full(4000, RELATIVE_ERROR), rel=0.1)


def test_readings_below_zero_have_a_logarithm() -> None:
    resistance = np.array([-300.0, 2e3, 4e4, 2e5] * 10)
    reading = log_above(resistance, floor_of([resistance]))
    assert np.isfinite(reading).all()
    assert np.all(np.diff(reading[:4]) > 0.0)
