"""The displacement that a velocity or an acceleration shows, against the motion that it is a derivative of."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.border.simulation import Stimulus
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.integrated_motion import integrate_motion

PERIOD_S, RATE = 1e-4, 2.0 * np.pi * 150.0
TIME_S = PERIOD_S * np.arange(20000)


def motion(phase: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ringing beside a slower tone: displacement, velocity, acceleration."""
    ringing, tone = complex(-3.0, RATE), 0.8j * RATE
    parts = [(np.exp(1j * phase), ringing), (0.3, tone)]
    return tuple(sum((c * s**k * np.exp(s * TIME_S)).real for c, s in parts) for k in range(3))


def record_of(name: str, reading: np.ndarray) -> FitRecord:
    """A record with this reading alone."""
    inputs = {"drive": np.zeros(len(reading))}
    stimulus = Stimulus(inputs=inputs, holds={"drive": "zero"}, period_s=PERIOD_S)
    return FitRecord(name="r", stimulus=stimulus, measured={name: reading})


def agree(found: np.ndarray, expected: np.ndarray) -> None:
    """Size and ends of the motion are those of the displacement."""
    assert found.std() == pytest.approx(expected.std(), rel=0.05)
    for level in (0.0, 0.003, 0.997, 1.0):
        assert np.quantile(found, level) == pytest.approx(np.quantile(expected, level), rel=0.1)


@pytest.mark.parametrize("phase", [0.3, 1.5, 2.5])
@pytest.mark.parametrize(("name", "order"), [("velocity", 1), ("acceleration", 2)])
def test_a_record_that_begins_in_motion_loses_its_first_periods(name: str, order: int, phase: float) -> None:
    courses = motion(phase)
    noise = 0.02 * courses[order].std() * np.random.default_rng(1).standard_normal(len(TIME_S))
    found = integrate_motion(record_of(name, courses[order] + noise), name, RATE)
    assert 0.9 * len(TIME_S) < len(found) < len(TIME_S)
    agree(found, courses[0][-len(found) :])


@pytest.mark.parametrize(("name", "order"), [("velocity", 1), ("acceleration", 2)])
def test_of_a_record_that_begins_at_rest_all_is_kept(name: str, order: int) -> None:
    courses = [np.exp(-0.5 * ((TIME_S - 0.2) / 0.02) ** 2) * np.cos(RATE * TIME_S)]
    for _ in range(order):
        courses.append(np.gradient(courses[-1], PERIOD_S))
    found = integrate_motion(record_of(name, courses[order]), name, RATE)
    assert len(found) == len(TIME_S)
    agree(found, courses[0])


def test_an_offset_of_the_reading_is_no_motion() -> None:
    acceleration = motion(0.3)[2]
    with_gravity = integrate_motion(
        record_of("acceleration", acceleration + acceleration.std()), "acceleration", RATE
    )
    plain = integrate_motion(record_of("acceleration", acceleration), "acceleration", RATE)
    assert with_gravity.std() == pytest.approx(plain.std(), rel=0.3)
