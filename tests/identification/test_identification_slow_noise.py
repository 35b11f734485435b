"""Noise without end towards zero frequency: its long details are as large as they are, and whitened they are not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rtctl.diagnosis.residual.projection import RecordRows, estimate_noise, project
from rtctl.identification.noise.slow_noise import LEVELS, SlowPart, fit_slow_part, sum_by_level

FloatArray = NDArray[np.float64]
STEEP = SlowPart(4.0 ** np.arange(LEVELS))


def one_over_f(rng: np.random.Generator, rows: int, samples: int) -> FloatArray:
    """(rows, samples): 1/f from a period in twice the record up, equal to white noise at a quarter of the rate."""
    frequency = np.fft.rfftfreq(2 * samples)
    size = np.sqrt(4.0 + np.where(frequency > 0.0, 1.0 / np.maximum(frequency, 0.5 / samples), 0.0))
    return np.fft.irfft(np.fft.rfft(rng.standard_normal((rows, 2 * samples))) * size)[:, :samples]


@pytest.mark.parametrize("samples", [1, 2, 3, 7, 64, 1000])
def test_details_are_orthonormal_at_any_length(samples: int) -> None:
    unchanged = SlowPart(np.ones(LEVELS)).whiten(np.eye(samples))
    np.testing.assert_allclose(unchanged, np.eye(samples), rtol=0.0, atol=1e-12)
    matrix = STEEP.whiten(np.eye(samples))
    np.testing.assert_allclose(matrix, matrix.T, rtol=0.0, atol=1e-12)
    _, numbers = sum_by_level(np.zeros((1, samples)))
    gains = np.sort(np.repeat(1.0 / np.sqrt(STEEP.variances), numbers.astype(int)))
    assert np.linalg.eigvalsh(matrix) == pytest.approx(gains, abs=1e-9)


def test_the_squares_of_all_levels_are_those_of_the_series() -> None:
    series = np.random.default_rng(0).standard_normal((3, 777))
    squares, numbers = sum_by_level(series)
    assert squares.sum() == pytest.approx(np.sum(series**2))
    assert numbers.sum() == 777


def test_white_noise_has_no_slow_part() -> None:
    rng = np.random.default_rng(1)
    parts = [fit_slow_part(*sum_by_level(rng.standard_normal((1, 3000)))) for _ in range(100)]
    seen = [one for one in parts if one is not None]
    assert len(seen) < 45  # 30 by its level
    assert all(one.variances[:6] == pytest.approx(1.0, abs=0.5) for one in seen)


def test_growing_details_are_found_and_made_white() -> None:
    slow = np.where(np.arange(LEVELS) < 5, 1.0, 2.0 ** (np.arange(LEVELS) - 4.0))
    coloured = SlowPart(1.0 / slow).whiten(np.random.default_rng(2).standard_normal((4, 4096)))
    squares, numbers = sum_by_level(coloured)
    found = fit_slow_part(squares, 4 * numbers)
    assert found is not None
    assert found.variances[:9] == pytest.approx(slow[:9], rel=0.4)
    squares, numbers = sum_by_level(found.whiten(coloured))
    assert squares[:9] / (4 * numbers[:9]) == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize("growth", [1.0, 1.5, 2.0])
def test_its_power_is_that_of_its_details(growth: float) -> None:
    part = SlowPart(np.where(np.arange(LEVELS) < 5, 1.0, growth ** (np.arange(LEVELS) - 4.0)))
    length = 4096
    covariance = np.linalg.inv(part.whiten(np.eye(length // 4)))
    power = float(np.mean(part.power(np.arange(length // 2 + 1) / length)))
    assert power == pytest.approx(float(np.mean(np.sum(covariance**2, axis=1))), rel=0.15)


def test_a_mean_that_was_taken_out_is_no_sign_of_a_slow_part() -> None:
    rng = np.random.default_rng(4)
    found = 0
    for _ in range(50):
        series = rng.standard_normal((1, 1024))
        found += fit_slow_part(*sum_by_level(series - series.mean())) is not None
    assert found < 25


def statistics_of_a_constant(*, slow: bool) -> float:
    """Mean square along an offset beside five fast directions, in units of what noise alone would have."""
    rng, found = np.random.default_rng(3), []
    for _ in range(40):
        fast = rng.standard_normal((5, 1, 3000))
        rows = [
            RecordRows(
                residual=one_over_f(rng, 1, 3000), shared=np.zeros((0, 1, 3000)), local=np.zeros((0, 1, 3000)),
                directions=np.concatenate((np.ones((1, 1, 3000)), fast)),
            )
            for _ in range(3)
        ]  # fmt: skip
        found.append(project(rows, estimate_noise(rows, slow=slow)).single()[0])
    return float(np.mean(found))


@pytest.mark.slow
def test_an_offset_in_slow_noise_is_as_uncertain_as_that_makes_it() -> None:
    assert statistics_of_a_constant(slow=False) > 3.0
    assert statistics_of_a_constant(slow=True) < 2.0
