"""The peak that an unmeasured force makes in a noise: its fit, and what whitening by it leaves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from rtctl.identification.noise.residual_noise import fit_noise_in_parts
from rtctl.identification.noise.resonant_part import HIGHEST, Resonance, deviance, shape

PERIOD_S = 1e-3
RESONANCE = Resonance(60.0, 0.01)


def answer(seed: int, samples: int = 20000) -> np.ndarray:
    """White noise of 1 beside a force's answer of about a tenth of its power."""
    rng = np.random.default_rng(seed)
    angle, radius = 2.0 * np.pi * 60.0 * PERIOD_S, np.exp(-0.01 * 2.0 * np.pi * 60.0 * PERIOD_S)
    poles = [1.0, -2.0 * radius * np.cos(angle), radius**2]
    forced = lfilter([1.0], poles, rng.standard_normal(samples + 3000))[3000:]
    return np.asarray(rng.standard_normal(samples) + 0.3 * forced / forced.std())


def peak_over_floor(series: list[np.ndarray]) -> float:
    """Mean periodogram within a bandwidth of the resonance over that elsewhere."""
    power = sum(np.abs(np.fft.rfft(one)) ** 2 for one in series)
    frequency = np.fft.rfftfreq(len(series[0]), PERIOD_S)
    near = np.abs(frequency - 60.0) < 0.6
    return float(np.mean(power[near]) / np.mean(power[~near]))


def test_a_narrow_peak_is_whitened_that_an_autoregression_leaves() -> None:
    series = [answer(1), answer(2)]
    plain = fit_noise_in_parts([one[None] for one in series], PERIOD_S, (), slow=False)
    found = fit_noise_in_parts([one[None] for one in series], PERIOD_S, (RESONANCE,), slow=False)
    assert peak_over_floor([plain.whiten(one) for one in series]) > 1.8, "of 34"
    assert peak_over_floor([found.whiten(one) for one in series]) == pytest.approx(1.0, abs=0.35)
    assert np.var(np.concatenate([found.whiten(one) for one in series])) == pytest.approx(1.0, abs=0.02)
    assert found.mean_square == pytest.approx(1.09, abs=0.03), "white 1, and the answer's 0.09"


def test_where_the_resonance_is_off_by_a_tenth_the_peak_is_found() -> None:
    """A spring that hardens moves it."""
    series = [answer(3), answer(4)]
    found = fit_noise_in_parts([one[None] for one in series], PERIOD_S, (Resonance(54.0, 0.008),), slow=False)
    assert peak_over_floor([found.whiten(one) for one in series]) == pytest.approx(1.0, abs=0.35)


def test_white_noise_has_no_peak() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        series = [rng.standard_normal((1, 5000))]
        assert not fit_noise_in_parts(series, PERIOD_S, (RESONANCE,), slow=False).resonant


@pytest.mark.parametrize("ratio", [1e-4, 0.01, 0.4])
@pytest.mark.parametrize("at", [0.002, 0.06, 0.4])
def test_the_compiled_deviance_is_that_of_the_spectrum(at: float, ratio: float) -> None:
    rng = np.random.default_rng(7)
    frequency = np.sort(at * rng.uniform(0.9, 1.1, 200))
    number = rng.integers(1, 9, 200).astype(float)
    power = number * rng.exponential(1.0, 200)
    half = np.pi * frequency
    for unknown in (np.array([1.0, 0.01, 0.2]), np.array([-2.0, -0.05, -1.0])):
        spectrum = shape(unknown, at, ratio, frequency)
        total = number.sum() + 700.0
        floor = (np.sum(power / spectrum) + 650.0) / total
        expected = 2.0 * (total * np.log(floor) + np.sum(number * np.log(spectrum)))
        found = deviance(unknown, at, ratio, np.sin(half), np.cos(half), power, number, 650.0, 700.0)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("unknown", [(1.0, 0.31, 0.0), (1.0, 0.0, 2.4), (np.log(HIGHEST) + 0.1, 0.0, 0.0)])
def test_beyond_its_range_there_is_no_peak(unknown: tuple[float, ...]) -> None:
    one = np.ones(3)
    assert deviance(np.array(unknown), 0.06, 0.01, 0.1 * one, one, one, one, 1.0, 1.0) == np.inf
