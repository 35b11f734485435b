"""Residuals as coloured noise: an autoregression to whiten them with and to compute honest standard errors.

    e_t + a_1 e_{t-1} + ... + a_m e_{t-m} = w_t,   w white

by Yule-Walker and Levinson over all records at once, with the order chosen by BIC. Treating coloured residuals as
white
makes every interval too short, often many times. The first m samples of a record are predicted from the fewer samples
before them by the predictors of lower order, so w is white from the first sample on. Noise slower than the
order reaches (1/f), and what a resonance makes of an unmeasured force, are modelled apart in `slow_noise` and
`resonant_part`; only restricted likelihood estimates them (`projection.estimate_noise`).

Reference: J. Durbin, The fitting of time-series models (1960).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray
from rtctl.identification.noise.resonant_part import PARAMETERS, Resonance, ResonantPart, fit_resonant_part
from rtctl.identification.noise.slow_noise import LEVELS, SlowPart, fit_slow_part, sum_by_level

HIGHEST_ORDER = 60
ROWS_AT_ONCE = 16
"""Rows transformed at once: limits memory, and they stay in the processor's cache."""
FINE_LENGTH = 4096
"""Length of a spectrum whose mean is the mean square."""
LONG_LENGTH = 2**16
"""Length of a spectrum that resolves lags of many samples."""
SAME_PERIOD_RATIO = 1.02
"""Ratio of two sample periods below which they count as the same."""
MAX_DIRECT_ORDER = 10
"""Highest order that is filtered sample by sample; above it FFTs are used."""


class NoiseModel(NamedTuple):
    """Autoregressive coefficients a (order,), the variance of w, and the slow part of w, for one sample period."""

    coefficients: FloatArray
    variance: float
    slow: SlowPart | None = None
    resonant: tuple[ResonantPart, ...] = ()
    """Resonant parts of w, before the slow one."""
    period_s: float = 0.0
    """Sample period [s]; 0 where the model holds for any."""
    others: tuple[NoiseModel, ...] = ()
    """Models for other sample periods: an autoregression is one of samples, a sensor's noise one of seconds."""

    def for_period(self, period_s: float) -> NoiseModel:
        """Return the model for a sample period [s]: this one, one of the others, or this one decimated."""
        for one in (self, *self.others):
            if not (one.period_s and period_s) or _are_same_period(one.period_s, period_s):
                return one
        times = round(period_s / self.period_s)
        return self.decimate(times) if times > 1 else self

    def decimate(self, times: int) -> NoiseModel:
        """Return the model of every `times`-th sample; its slow part as far as an autoregression reaches."""
        correlation = irfft(self.power(LONG_LENGTH), LONG_LENGTH)[: times * (HIGHEST_ORDER + 1) : times]
        made = fit_autoregression(correlation * LONG_LENGTH, LONG_LENGTH)
        return made._replace(period_s=times * self.period_s)

    def scale_variance(self, times: float) -> NoiseModel:
        """Return the model with `times` the variance, at every sample period."""
        others = tuple(one.scale_variance(times) for one in self.others)
        return self._replace(variance=times * self.variance, others=others)

    def whiten(self, series: FloatArray) -> FloatArray:
        """Whiten a series (..., n): variance 1, slow and resonant parts removed.

        It is 1 from the first sample on, but for a resonant part, which begins as if there had been no noise before.
        """
        order = len(self.coefficients)
        kernel = np.append(1.0, self.coefficients) / np.sqrt(self.variance or 1.0)
        if order <= MAX_DIRECT_ORDER:
            whitened: FloatArray = lfilter(kernel, np.ones(1), series, axis=-1)
        else:
            whitened = _filter_by_fft(kernel, series)
        begin = min(order, series.shape[-1])
        whitened[..., :begin] = series[..., :begin] @ self._begin()[:begin, :begin].T
        for part in self.resonant:
            whitened = part.whiten(whitened)
        return whitened if self.slow is None else self.slow.whiten(whitened)

    def _begin(self) -> FloatArray:
        """Return a lower triangle (m, m): predictors of order 0 to m - 1, each over its standard deviation."""
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
        """Mean square of the noise itself."""
        return float(np.mean(self.power(FINE_LENGTH)))

    def power(self, length: int) -> FloatArray:
        """Return the power (length // 2 + 1,) at the frequencies of a real FFT of `length`."""
        response = np.abs(rfft(np.append(1.0, self.coefficients), length)) ** 2
        density: FloatArray = self.variance / np.maximum(response, 1e-300)
        frequencies = np.arange(len(density)) / length
        for part in self.resonant:
            density = density * part.power(frequencies)
        return density if self.slow is None else density * self.slow.power(frequencies)


def _filter_by_fft(kernel: FloatArray, series: FloatArray) -> FloatArray:
    """Apply a finite impulse response to the series (..., n) and keep their length."""
    rows = series.reshape(-1, series.shape[-1])
    length = int(next_fast_len(rows.shape[1] + len(kernel) - 1, real=True))
    response = rfft(kernel, length)
    found = np.empty(rows.shape)
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        here = slice(begin, begin + ROWS_AT_ONCE)
        found[here] = irfft(rfft(rows[here], length) * response, length)[:, : rows.shape[1]]
    return found.reshape(series.shape)


def fit_noise_by_period(series: Sequence[FloatArray], periods_s: Sequence[float]) -> NoiseModel:
    """Fit a noise model to residuals, one array (n,) a record, with the sample period [s] of each record."""
    groups = group_by_period(periods_s)
    made = [fit_noise([series[k] for k in own])._replace(period_s=periods_s[own[0]]) for own in groups]
    return combine_models(made, [sum(len(series[k]) for k in own) for own in groups])


def fit_noise(series: Sequence[FloatArray], highest_order: int = HIGHEST_ORDER) -> NoiseModel:
    """Fit an autoregression to residuals, one array (n,) a record. Constant zero gives variance 0."""
    count = sum(len(one) for one in series)
    highest = limit_order([len(one) for one in series], highest_order)
    correlation = np.sum([sum_lagged_products(one, highest) for one in series], axis=0)
    return fit_autoregression(correlation, count)


def group_by_period(periods_s: Sequence[float]) -> list[list[int]]:
    """Return groups of indices with the same sample period, the shortest period first."""
    groups: list[list[int]] = []
    for k in sorted(range(len(periods_s)), key=lambda k: periods_s[k]):
        if groups and _are_same_period(periods_s[groups[-1][0]], periods_s[k]):
            groups[-1].append(k)
        else:
            groups.append([k])
    return groups


def _are_same_period(one_s: float, other_s: float) -> bool:
    """Return whether two periods [s] count as the same."""
    return max(one_s, other_s) <= SAME_PERIOD_RATIO * min(one_s, other_s)


def combine_models(models: Sequence[NoiseModel], samples: Sequence[int]) -> NoiseModel:
    """Return one model for records of several periods; that with the most `samples` is the main one."""
    main = max(range(len(models)), key=lambda k: samples[k])
    return models[main]._replace(others=tuple(one for k, one in enumerate(models) if k != main))


def limit_order(lengths: Sequence[int], highest_order: int = HIGHEST_ORDER) -> int:
    """Return the highest order that records of these lengths can support."""
    return max(0, min(highest_order, sum(lengths) // 20, min(lengths) - 1))


def fit_noise_in_parts(
    series: Sequence[FloatArray], period_s: float, resonances: Sequence[Resonance], *, slow: bool
) -> NoiseModel:
    """Fit a noise model to residuals, with resonant parts and a slow one where the data show them.

    Args:
        series: One array (rows, n) a record. Its first row is the residual; the squares of the others restore what a
            projection removed from it.
        period_s: Sample period [s].
        resonances: Resonances of the device, at which a resonant part is looked for.
        slow: Whether to look for a slow part.
    """
    count = sum(one.shape[1] for one in series)
    model = _fit_rows(series)
    if not model.variance > 0.0:
        return model
    for resonance in resonances:
        rivals = [model, *_with_peak(series, model, resonance, period_s)]
        model = min(rivals, key=lambda one: _bic(one, count))
    if not slow:
        return model
    squares, numbers = np.zeros(LEVELS), np.zeros(LEVELS)
    for one in series:
        own, count = sum_by_level(model.whiten(one))
        squares, numbers = squares + own, numbers + count
    return model._replace(slow=fit_slow_part(squares, numbers))


def _fit_rows(series: Sequence[FloatArray]) -> NoiseModel:
    """Fit an autoregression to arrays (rows, n), whose squares add."""
    lengths = [one.shape[1] for one in series]
    highest = limit_order(lengths)
    correlation = np.sum([sum_lagged_products(one, highest) for one in series], axis=0)
    return fit_autoregression(correlation, sum(lengths))


def _with_peak(
    series: Sequence[FloatArray], model: NoiseModel, resonance: Resonance, period_s: float
) -> Iterator[NoiseModel]:
    """Yield models with a resonant part: behind the autoregression, and before one that is fitted to what it leaves."""
    behind = fit_resonant_part([model.whiten(one) for one in series], resonance, period_s)
    if behind is not None:
        part, variance = behind
        yield model._replace(resonant=(*model.resonant, part), variance=model.variance * variance)
    first = fit_resonant_part(series, resonance, period_s)
    if first is not None and not model.resonant:
        yield _fit_rows([first[0].whiten(one) for one in series])._replace(resonant=(first[0],))


def _bic(model: NoiseModel, count: int) -> float:
    """Return the BIC of a noise over `count` samples, its size included in the likelihood."""
    unknowns = len(model.coefficients) + PARAMETERS * len(model.resonant)
    return count * float(np.log(model.variance)) + unknowns * float(np.log(count))


def without_hole(model: NoiseModel) -> NoiseModel:
    """Return a noise model whose slow part is nowhere quieter than the rest of it."""
    if model.slow is None:
        return model
    return model._replace(slow=SlowPart(np.maximum(model.slow.variances, 1.0)))


def fit_autoregression(correlation: FloatArray, count: int) -> NoiseModel:
    """Fit an autoregression to sums of products (lags,) over `count` samples, with the order by BIC."""
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
    """Return J R J^T (p, p) for slopes J (p, n) and the noise's covariance R, by its power spectrum."""
    n = slopes.shape[1]
    length = int(next_fast_len(n + min(n, 4096), real=True))
    spectrum = rfft(slopes, length)
    weight = noise.power(length) / length
    weight[1 : (length + 1) // 2] *= 2.0
    gram: FloatArray = ((spectrum * weight) @ spectrum.conj().T).real
    return gram


def sum_lagged_products(series: FloatArray, highest: int) -> FloatArray:
    """Return sums of products (highest + 1,) at lags from 0 of a series (n,), or of several (rows, n) together."""
    rows = np.atleast_2d(series)
    length = int(next_fast_len(rows.shape[1] + highest, real=True))
    power = np.zeros(length // 2 + 1)
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        spectrum = rfft(rows[begin : begin + ROWS_AT_ONCE], length)
        power += np.sum(spectrum.real**2 + spectrum.imag**2, axis=0)
    found: FloatArray = irfft(power, length)[: highest + 1]
    return found
