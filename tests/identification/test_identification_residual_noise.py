"""Coloured noise: whitening is exact from the first sample on, and unknowns that take noise do not hide it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from rtctl.diagnosis.residual.projection import RecordRows, estimate_noise, project
from rtctl.identification.noise.residual_noise import FINE_LENGTH, NoiseModel, fit_noise
from rtctl.identification.noise.resonant_part import Resonance
from rtctl.identification.noise.slow_noise import SlowPart

FloatArray = NDArray[np.float64]
SLOW = NoiseModel(np.array([-0.97]), 0.5)
RESONANT = NoiseModel(np.array([-1.5, 0.9]), 2.0)
LONG = NoiseModel(np.convolve([1.0, -1.5, 0.9], np.r_[1.0, np.zeros(13), -0.3])[1:], 1.0)


@pytest.mark.parametrize("noise", [SLOW, RESONANT, LONG])
def test_whitened_noise_is_white_from_its_first_sample_on(noise: NoiseModel) -> None:
    samples, length = 60, 2**14
    covariance = toeplitz(np.fft.irfft(noise.power(length), length)[:samples])
    whitening = noise.whiten(np.eye(samples)).T
    assert whitening @ covariance @ whitening.T == pytest.approx(np.eye(samples), abs=1e-6)


def test_a_filter_by_fft_is_the_filter_sample_by_sample() -> None:
    series = np.random.default_rng(0).standard_normal((3, 500))
    direct = lfilter(np.append(1.0, LONG.coefficients), np.ones(1), series)
    order = len(LONG.coefficients)
    assert LONG.whiten(series)[:, order:] == pytest.approx(direct[:, order:], abs=1e-9)


def test_an_unstable_autoregression_is_refused() -> None:
    with pytest.raises(ValueError, match="not stable"):
        NoiseModel(np.array([-1.5]), 1.0).whiten(np.ones(10))


def test_an_autoregression_is_found_in_its_noise() -> None:
    noise = lfilter([np.sqrt(2.0)], [1.0, -1.5, 0.9], np.random.default_rng(1).standard_normal((2, 8000)))
    found = fit_noise(list(noise))
    assert found.coefficients[:2] == pytest.approx([-1.5, 0.9], abs=0.03)
    assert found.variance == pytest.approx(2.0, rel=0.05)


def narrow_rows(rng: np.random.Generator, directions: int, samples: int = 900) -> RecordRows:
    """AR(1) noise, and directions that all lie in one narrow band, as those of a resonator do."""
    band = lfilter([1.0], [1.0, -1.9, 0.95], rng.standard_normal((directions + 2, samples)))
    noise = lfilter([1.0], [1.0, -0.8], rng.standard_normal(samples + 200))[200:]
    return RecordRows(
        residual=noise[None], shared=band[:1, None], local=band[1:2, None], directions=band[2:, None]
    )


def test_many_directions_in_a_narrow_band_remove_no_more_than_their_number() -> None:
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(60):
        rows = [narrow_rows(rng, 40)]
        statistic, freedom = project(rows, estimate_noise(rows)).block(np.arange(40))
        ratios.append(statistic / freedom)
    # The mean of 60 chi-squares of 40 over their freedom is 1 +- 0.03; the leftover alone gives 1.4.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.09)


def test_the_size_of_noise_is_not_what_the_directions_leave_of_it() -> None:
    rng = np.random.default_rng(3)
    samples, count = 400, 400
    rows = [
        RecordRows(
            residual=rng.standard_normal((1, samples)),
            shared=rng.standard_normal((2, 1, samples)),
            local=np.zeros((0, 1, samples)),
            directions=rng.standard_normal((count, 1, samples)),
        )
        for _ in range(4)
    ]
    power = float(estimate_noise(rows)[0].power(64).mean())
    assert power == pytest.approx(1.0, abs=0.12)  # three standard errors of 0.04; the leftover alone has 0.75


def of_ar1(rng: np.random.Generator, pole: float, samples: int) -> FloatArray:
    """Unit variance."""
    made: FloatArray = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.standard_normal(samples + 400))[
        400:
    ]
    return made


def test_of_every_third_sample_noise_has_the_colour_of_every_third_sample() -> None:
    noise = NoiseModel(np.array([-1.5, 0.9]), 2.0, period_s=1e-3)
    third, length = noise.decimate(3), 2**14
    correlation = np.fft.irfft(noise.power(length), length)
    assert np.fft.irfft(third.power(length), length)[:20] == pytest.approx(
        correlation[:60:3], abs=0.03 * correlation[0]
    )
    assert third.period_s == pytest.approx(3e-3)


def test_what_is_known_of_a_period_goes_before_what_follows_from_another() -> None:
    slow = NoiseModel(np.array([-0.2]), 5.0, period_s=2e-3)
    noise = NoiseModel(np.array([-0.9]), 2.0, period_s=1e-3, others=(slow,))
    assert noise.for_period(1.001e-3) is noise
    assert noise.for_period(1.999e-3) is slow
    assert noise.for_period(4e-3).coefficients[0] == pytest.approx(-(0.9**4), rel=1e-3)
    assert noise.for_period(0.0) is noise
    assert noise.scale_variance(4.0).for_period(2e-3).variance == 20.0


def test_records_sampled_at_two_periods_are_whitened_each_in_its_own_colour() -> None:
    """A sensor's noise is of seconds: at an eighth of the rate an autoregression of samples is another."""
    rng = np.random.default_rng(8)
    rows = [
        RecordRows(residual=one[None], shared=nothing, local=nothing, directions=nothing, period_s=period_s)
        for one, period_s in ((of_ar1(rng, 0.95, 8000), 1e-3), (of_ar1(rng, 0.95, 64_000)[::8], 8e-3))
        for nothing in [np.zeros((0, 1, len(one)))]
    ]

    def left(made: list[RecordRows]) -> list[float]:
        """Correlation of neighbours."""
        found = []
        for row in made:
            white = row.whitened(estimate_noise(made))[0][0]
            found.append(float(white[1:] @ white[:-1] / (white @ white)))
        return found

    assert left(rows) == pytest.approx([0.0, 0.0], abs=4.0 / np.sqrt(8000))
    blind = [replace(row, period_s=0.0) for row in rows]
    assert max(abs(one) for one in left(blind)) > 0.1


@pytest.mark.parametrize("root", [0.5, 0.9, 0.999, 0.9999])
def test_its_mean_square_is_that_of_the_autoregression(root):
    assert NoiseModel(np.array([-root]), 2.0).mean_square == pytest.approx(2.0 / (1.0 - root**2), rel=1e-9)


def test_its_mean_square_is_that_of_a_series():
    """Of order two, against the Yule-Walker equations: gamma_0 = variance / (1 - rho_1 a_1 - rho_2 a_2)."""
    first, second = 1.6, -0.9
    one = first / (1.0 - second)
    gamma = 3.0 / (1.0 - first * one - second * (first * one + second))
    assert NoiseModel(np.array([-first, -second]), 3.0).mean_square == pytest.approx(gamma, rel=1e-9)


def test_frequencies_at_the_ends_of_the_spectrum_count_half():
    """Of a slow part over so many samples, by the series that has the power: Parseval."""
    model = NoiseModel(np.array([-0.9]), 2.0, SlowPart(corner=0.1, exponent=2.0))
    phases = np.exp(2j * np.pi * np.random.default_rng(1).random(FINE_LENGTH // 2 + 1))
    phases[[0, -1]] = 1.0
    series = np.fft.irfft(np.sqrt(FINE_LENGTH * model.power(FINE_LENGTH)) * phases, FINE_LENGTH)
    assert model.mean_square == pytest.approx(np.mean(series**2), rel=1e-9)


def test_outputs_in_unlike_units_keep_the_noise_of_their_own() -> None:
    """A displacement in mm and its acceleration in mm/s^2, which says little of slow motions.

    With numbers of one size the acceleration alone would tell how large a slow direction is, 1e5 times too loosely.
    """
    rng = np.random.default_rng(6)
    samples, period_s = 4000, 5e-4
    noise = np.array([0.008, 2000.0])
    slow = np.cumsum(np.cumsum(rng.standard_normal((40, samples)), axis=1), axis=1)
    slow -= slow.mean(axis=1, keepdims=True)
    slow /= slow.std(axis=1, keepdims=True)
    directions = np.stack((slow, np.gradient(np.gradient(slow, period_s, axis=1), period_s, axis=1)), axis=1)
    residual = noise[:, None] * rng.standard_normal((2, samples))
    nothing = np.zeros((0, 2, samples))
    rows = RecordRows(
        residual=residual, shared=nothing, local=nothing, directions=directions, period_s=period_s
    )
    found = [
        one.mean_square**0.5 for one in estimate_noise([rows], resonances=[Resonance(80.0, 0.015)], slow=True)
    ]
    assert found == pytest.approx(noise, rel=0.05)
