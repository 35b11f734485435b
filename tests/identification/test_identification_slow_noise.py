"""Noise without end towards zero frequency: found by its law, whitened, and as uncertain as it makes an offset."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from rtctl.diagnosis.residual.projection import RecordRows, estimate_noise, project
from rtctl.identification.noise.residual_noise import NoiseModel, fit_noise_in_parts
from rtctl.identification.noise.slow_noise import SlowPart, fit_slow_part, spectrum_of

FloatArray = NDArray[np.float64]


def of_power(rng: np.random.Generator, rows: int, samples: int, power: SlowPart) -> FloatArray:
    """(rows, samples) of noise of unit power times that of a slow part."""
    length = 4 * samples
    size = np.sqrt(power.power(np.fft.rfftfreq(length)))
    return np.fft.irfft(np.fft.rfft(rng.standard_normal((rows, length))) * size)[:, :samples]


def one_over_f(rng: np.random.Generator, rows: int, samples: int) -> FloatArray:
    """(rows, samples): 1/f from a period in twice the record up, equal to white noise at a quarter of the rate."""
    frequency = np.fft.rfftfreq(2 * samples)
    size = np.sqrt(4.0 + np.where(frequency > 0.0, 1.0 / np.maximum(frequency, 0.5 / samples), 0.0))
    return np.fft.irfft(np.fft.rfft(rng.standard_normal((rows, 2 * samples))) * size)[:, :samples]


def test_a_spectrum_in_cells_has_the_mean_square_and_the_correlation_of_the_series() -> None:
    series = np.random.default_rng(0).standard_normal((3, 777))
    series[:, 1:] += series[:, :-1]
    spectrum = spectrum_of([series])
    exact = [float(np.sum(series[:, k:] * series[:, : 777 - k])) / 777 for k in range(8)]
    assert spectrum.share.sum() == pytest.approx(1.0)
    assert spectrum.correlation(7) == pytest.approx(exact, abs=2e-3 * exact[0])


def test_white_noise_has_no_slow_part() -> None:
    rng = np.random.default_rng(1)
    found = [fit_noise_in_parts([rng.standard_normal((1, 3000))], 1.0, (), slow=True) for _ in range(100)]
    assert sum(one.slow is not None for one in found) < 5


def test_a_mean_that_was_taken_out_is_no_sign_of_a_slow_part() -> None:
    rng = np.random.default_rng(4)
    made = [rng.standard_normal((1, 1024)) for _ in range(50)]
    found = [fit_noise_in_parts([one - one.mean()], 1.0, (), slow=True) for one in made]
    assert sum(one.slow is not None for one in found) < 5


@pytest.mark.parametrize("exponent", [1.0, 2.0])
@pytest.mark.parametrize("colour", [0.0, 0.6])
def test_a_law_is_found_beside_a_colour_and_made_white(exponent: float, colour: float) -> None:
    truth = SlowPart(0.02, exponent)
    series = of_power(np.random.default_rng(2), 1, 16384, truth)[0]
    for k in range(1, len(series)):
        series[k] += colour * series[k - 1]
    series = series[200:]
    found = fit_noise_in_parts([series[None]], 1.0, (), slow=True)
    assert found.slow is not None
    assert len(found.coefficients) <= 3
    at = np.array([1e-3, 3e-3, 1e-2])
    ratio = found.slow.power(at) / truth.power(at)
    assert ratio / ratio[2] == pytest.approx(1.0, abs=0.5)
    white = found.whiten(series)
    pieces = white[: len(white) // 256 * 256].reshape(-1, 256).mean(axis=1)
    assert np.mean(white**2) == pytest.approx(1.0, abs=0.05)
    assert 256.0 * np.mean(pieces**2) == pytest.approx(1.0, abs=0.6)


@pytest.mark.parametrize("samples", [3, 50, 700])
def test_whitening_is_that_of_the_covariance_from_the_first_sample_on(samples: int) -> None:
    model = NoiseModel(np.array([-0.5]), 2.0, SlowPart(0.05, 1.0))
    power = model.power(2**16)
    lags = np.fft.irfft(power)[:samples]
    covariance = lags[np.abs(np.subtract.outer(np.arange(samples), np.arange(samples)))]
    matrix = model.whiten(np.eye(samples)).T
    np.testing.assert_allclose(matrix @ covariance @ matrix.T, np.eye(samples), atol=5e-3)


def test_what_was_taken_out_entirely_leaves_nothing_to_fit() -> None:
    spectrum = spectrum_of([np.zeros((1, 100))])
    assert fit_slow_part(spectrum, 100, 5, np.ones(len(spectrum.power))) is None


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


def test_a_noise_beyond_rounding_is_still_whitened() -> None:
    """A random walk beside an autoregression next to it: predictors end before the order that whitens it."""
    nearly_integrated = np.poly([0.99999, 0.99999, 0.99999])[1:]
    model = NoiseModel(nearly_integrated, 1e-12, SlowPart(0.1, 2.0))
    series = np.cumsum(np.cumsum(np.random.default_rng(5).standard_normal((1, 4000)), axis=1), axis=1)
    whitened = model.whiten(series)
    assert np.all(np.std(whitened[:, 600:], axis=1) > 0.0)
    assert np.isfinite(whitened).all()


def test_records_with_constants_of_their_own_have_no_slow_noise() -> None:
    """An instrument that is set to zero before each record: a constant's periodogram falls as that of a random walk."""
    rng = np.random.default_rng(8)
    series = [constant + rng.standard_normal((1, 1500)) for constant in (-5.0, 5.0)]
    assert fit_noise_in_parts(series, 1.0, (), slow=True).slow is None
