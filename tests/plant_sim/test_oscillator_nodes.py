"""The drive at the integrator's instants is what the hold says, delayed by any part of an interval."""

from __future__ import annotations

import numpy as np
import pytest

from plant_sim.oscillator.integration.holds import nodes

SAMPLES = np.random.default_rng(4).standard_normal(12)
DELAYS = [0.0, 0.25, 1.0, 1.37, 3.0, 20.0]


def instants(substeps: int) -> np.ndarray:
    """Of start, middle and end of each step, in intervals."""
    steps = np.arange((len(SAMPLES) - 1) * substeps)[:, None]
    return (steps + 0.5 * np.arange(3)) / substeps


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("substeps", [1, 3])
def test_linear_is_the_line_between_the_samples(substeps: int, delay: float) -> None:
    expected = np.interp(instants(substeps) - delay, np.arange(len(SAMPLES)), SAMPLES)
    assert np.allclose(nodes(SAMPLES, "linear", substeps, delay), expected, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("substeps", [1, 3, 7])
def test_held_has_the_impulse_of_the_jumps_and_its_place_wherever_they_fall(
    substeps: int, delay: float
) -> None:
    fine = 10_000  # points a step
    at = (np.arange((len(SAMPLES) - 1) * substeps * fine) + 0.5) / (substeps * fine) - delay
    held = SAMPLES[np.clip(np.floor(at), 0, len(SAMPLES) - 1).astype(int)].reshape(-1, fine)
    s = (np.arange(fine) + 0.5) / fine
    start, middle, end = nodes(SAMPLES, "zero", substeps, delay).T
    by_simpson = [
        (start + 4.0 * middle + end) / 6.0,
        (2.0 * middle + end) / 6.0,
    ]  # exact for a parabola, twice
    accuracy = 2.0 * np.ptp(SAMPLES) / fine
    assert np.allclose(by_simpson[0], held.mean(axis=1), rtol=0.0, atol=accuracy)
    assert np.allclose(by_simpson[1], (s * held).mean(axis=1), rtol=0.0, atol=accuracy)
    inside = np.ptp(held, axis=1) > 0.0
    assert np.allclose(middle[~inside], held[~inside, 0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.25, 1.37])
def test_band_limited_is_the_sine_that_was_sampled(delay: float) -> None:
    angle = 0.55 * np.arange(600)
    found = nodes(np.sin(angle), "band-limited", 4, delay)
    steps = np.arange(599 * 4)[:, None]
    expected = np.sin(0.55 * ((steps + 0.5 * np.arange(3)) / 4 - delay))
    middle = slice(4 * 150, -4 * 150)  # its ends are continued, not known
    assert np.abs(found - expected)[middle].max() < 1e-3


def test_an_undelayed_hold_jumps_at_its_samples() -> None:
    assert np.array_equal(nodes(SAMPLES, "zero", 2)[:, 0], np.repeat(SAMPLES[:-1], 2))
