"""What is left after a fit as coloured noise: an autoregression, to whiten with and to state honest errors by.

    e_t + a_1 e_{t-1} + ... + a_m e_{t-m} = w_t,   w white

by Yule-Walker and Levinson over all records at once, the order by BIC. Treating coloured residuals as white makes
every interval too short (often many times). The first m samples of a record are predicted from the fewer that are
there, by the predictors of lower order: so w is white from the first sample on. What is slower than the order
reaches (1/f) is a part of its own, see `slow_noise`; only restricted likelihood looks for one (`projection.noise_of`).

Reference: J. Durbin, The fitting of time-series models (1960).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray
from rtctl.identification.noise.slow_noise import LEVELS, SlowPart, fit_slow_part, sum_by_level

HIGHEST_ORDER = 60
ROWS_AT_ONCE = 16
"""Of a spectrum of many: memory, and what a processor keeps at hand."""
FINE_LENGTH = 4096
"""Length of a spectrum whose mean is the mean square."""
LONG_LENGTH = 2**16
"""Length of one that tells lags of many samples."""
SAME_PERIOD_RATIO = 1.02
"""Ratio of two periods below which records are sampled alike."""
MAX_DIRECT_ORDER = 10
"""Highest order that is filtered sample by sample; above, by FFT."""


class NoiseModel(NamedTuple):
    """Coefficients a (order,), the variance of w and what of w is slow; of records of one period."""

    coefficients: FloatArray
    variance: float
    slow: SlowPart | None = None
    period_s: float = 0.0
    """Between samples; 0: whatever it is."""
    others: tuple[NoiseModel, ...] = ()
    """Of records that are sampled at other periods: an autoregression is of samples, a sensor's noise of seconds."""

    def for_period(self, period_s: float) -> NoiseModel:
        """Of records sampled every `period_s`: its own, one of the others, or what every so many samples have of it."""
        for one in (self, *self.others):
            if not (one.period_s and period_s) or _are_same_period(one.period_s, period_s):
                return one
        times = round(period_s / self.period_s)
        return self.decimate(times) if times > 1 else self

    def decimate(self, times: int) -> NoiseModel:
        """Of one sample in `times`; the slow part of it as far as an autoregression reaches."""
        correlation = irfft(self.power(LONG_LENGTH), LONG_LENGTH)[: times * (HIGHEST_ORDER + 1) : times]
        made = fit_autoregression(correlation * LONG_LENGTH, LONG_LENGTH)
        return made._replace(period_s=times * self.period_s)

    def scale_variance(self, times: float) -> NoiseModel:
        """Of so many times the variance, at every period."""
        others = tuple(one.scale_variance(times) for one in self.others)
        return self._replace(variance=times * self.variance, others=others)

    def whiten(self, series: FloatArray) -> FloatArray:
        """w of the series (..., n), standardised to variance 1 from the first sample on; without its slow part."""
        order = len(self.coefficients)
        kernel = np.append(1.0, self.coefficients) / np.sqrt(self.variance or 1.0)
        if order <= MAX_DIRECT_ORDER:
            whitened: FloatArray = lfilter(kernel, np.ones(1), series, axis=-1)
        else:
            whitened = _filter_by_fft(kernel, series)
        begin = min(order, series.shape[-1])
        whitened[..., :begin] = series[..., :begin] @ self._begin()[:begin, :begin].T
        return whitened if self.slow is None else self.slow.whiten(whitened)

    def _begin(self) -> FloatArray:
        """Lower triangle (m, m): the predictors of order 0 to m - 1, each over its own standard deviation."""
        a, variance = self.coefficients, self.variance or 1.0
        triangle = np.zeros((len(a), len(a)))
        for order in range(len(a) - 1, -1, -1):  # Levinson's recurrence backwards
            reflection = a[-1]
            left = 1.0 - reflection**2
            if not left > 0.0:
                raise ValueError(f"the autoregression {self.coefficients!r} is not stable")
            variance = variance / left
            a = (a[:-1] - reflection * a[-2::-1]) / left
            triangle[order, : order + 1] = np.append(a[::-1], 1.0) / np.sqrt(variance)
        return triangle

    @property
    def mean_square(self) -> float:
        """Of the noise itself."""
        return float(np.mean(self.power(FINE_LENGTH)))

    def power(self, length: int) -> FloatArray:
        """Power (length // 2 + 1,) at the frequencies of a real FFT of `length`; white noise: its variance."""
        response = np.abs(rfft(np.append(1.0, self.coefficients), length)) ** 2
        density: FloatArray = self.variance / np.maximum(response, 1e-300)
        return density if self.slow is None else density * self.slow.power(np.arange(len(density)) / length)


def _filter_by_fft(kernel: FloatArray, series: FloatArray) -> FloatArray:
    """The series (..., n) through a filter of finite response, as long as they were."""
    rows = series.reshape(-1, series.shape[-1])
    length = int(next_fast_len(rows.shape[1] + len(kernel) - 1, real=True))
    response = rfft(kernel, length)
    found = np.empty(rows.shape)
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        here = slice(begin, begin + ROWS_AT_ONCE)
        found[here] = irfft(rfft(rows[here], length) * response, length)[:, : rows.shape[1]]
    return found.reshape(series.shape)


def fit_noise_by_period(series: Sequence[FloatArray], periods_s: Sequence[float]) -> NoiseModel:
    """Of residuals, one array (n,) a record, that are sampled every so often."""
    groups = group_by_period(periods_s)
    made = [fit_noise([series[k] for k in own])._replace(period_s=periods_s[own[0]]) for own in groups]
    return combine_models(made, [sum(len(series[k]) for k in own) for own in groups])


def fit_noise(series: Sequence[FloatArray], highest_order: int = HIGHEST_ORDER) -> NoiseModel:
    """Of residuals, one array (n,) a record. Constant zero gives variance 0."""
    count = sum(len(one) for one in series)
    highest = limit_order([len(one) for one in series], highest_order)
    correlation = np.sum([sum_lagged_products(one, highest) for one in series], axis=0)
    return fit_autoregression(correlation, count)


def group_by_period(periods_s: Sequence[float]) -> list[list[int]]:
    """Indices of periods that are the same, the shortest first."""
    groups: list[list[int]] = []
    for k in sorted(range(len(periods_s)), key=lambda k: periods_s[k]):
        if groups and _are_same_period(periods_s[groups[-1][0]], periods_s[k]):
            groups[-1].append(k)
        else:
            groups.append([k])
    return groups


def _are_same_period(one_s: float, other_s: float) -> bool:
    return max(one_s, other_s) <= SAME_PERIOD_RATIO * min(one_s, other_s)


def combine_models(models: Sequence[NoiseModel], samples: Sequence[int]) -> NoiseModel:
    """One model of records sampled at several periods: that of the most `samples` speaks for all where one has to."""
    main = max(range(len(models)), key=lambda k: samples[k])
    return models[main]._replace(others=tuple(one for k, one in enumerate(models) if k != main))


def limit_order(lengths: Sequence[int], highest_order: int = HIGHEST_ORDER) -> int:
    """Highest order that records of these lengths can carry."""
    return max(0, min(highest_order, sum(lengths) // 20, min(lengths) - 1))


def fit_noise_with_slow_part(series: Sequence[FloatArray], *, slow: bool) -> NoiseModel:
    """Of residuals (rows, n), one array a record, of which the first row is what is left and the others, in squares,
    what was taken of it; with a `slow` part where asked and seen.
    """
    lengths = [one.shape[1] for one in series]
    highest = limit_order(lengths)
    correlation = np.sum([sum_lagged_products(one, highest) for one in series], axis=0)
    model = fit_autoregression(correlation, sum(lengths))
    if not slow or not model.variance > 0.0:
        return model
    squares, numbers = np.zeros(LEVELS), np.zeros(LEVELS)
    for one in series:
        own, count = sum_by_level(model.whiten(one))
        squares, numbers = squares + own, numbers + count
    return model._replace(slow=fit_slow_part(squares, numbers))


def fit_autoregression(correlation: FloatArray, count: int) -> NoiseModel:
    """From sums of products (lags,) over `count` samples; the order by BIC."""
    correlation = correlation / count
    if not correlation[0] > 0.0:
        return NoiseModel(np.empty(0), 0.0)
    best, best_bic = NoiseModel(np.empty(0), float(correlation[0])), count * np.log(correlation[0])
    a, variance = np.empty(0), float(correlation[0])
    for order in range(1, len(correlation)):
        reflection = -(correlation[order] + a @ correlation[order - 1 : 0 : -1]) / variance
        a = np.append(a + reflection * a[::-1], reflection)
        variance *= 1.0 - reflection**2
        if not variance > 0.0:
            break
        bic = count * np.log(variance) + order * np.log(count)
        if bic < best_bic:
            best, best_bic = NoiseModel(a, float(variance)), bic
    return best


def compute_coloured_gram(slopes: FloatArray, noise: NoiseModel) -> FloatArray:
    """J R J^T (p, p) for slopes J (p, n) and the noise's covariance R, by its power spectrum."""
    n = slopes.shape[1]
    length = int(next_fast_len(n + min(n, 4096), real=True))
    spectrum = rfft(slopes, length)
    weight = noise.power(length) / length
    weight[1 : (length + 1) // 2] *= 2.0
    gram: FloatArray = ((spectrum * weight) @ spectrum.conj().T).real
    return gram


def sum_lagged_products(series: FloatArray, highest: int) -> FloatArray:
    """Sums of products (highest + 1,) at lags from 0 of a series (n,), or of all of several (rows, n) together."""
    rows = np.atleast_2d(series)
    length = int(next_fast_len(rows.shape[1] + highest, real=True))
    power = np.zeros(length // 2 + 1)
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        spectrum = rfft(rows[begin : begin + ROWS_AT_ONCE], length)
        power += np.sum(spectrum.real**2 + spectrum.imag**2, axis=0)
    found: FloatArray = irfft(power, length)[: highest + 1]
    return found
