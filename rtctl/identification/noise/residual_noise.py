"""Residuals as coloured noise: an autoregression to whiten them with and to compute honest standard errors.

    e_t + a_1 e_{t-1} + ... + a_m e_{t-m} = w_t,   w white

by Yule-Walker and Levinson over all records at once, with the order chosen by BIC. Treating coloured residuals as white
makes every interval too short, often many times. The first m samples of a record are predicted from the fewer samples
before them by the predictors of lower order, so w is white from the first sample on. Noise slower than the order
reaches (1/f), and what a resonance makes of an unmeasured force, are modelled apart in `slow_noise` and
`resonant_part`; only restricted likelihood estimates them (`projection.estimate_noise`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from rtctl.border.arrays import FloatArray
from rtctl.identification.noise import autoregression
from rtctl.identification.noise.autoregression import sum_lagged_products
from rtctl.identification.noise.resonant_part import PARAMETERS, Resonance, ResonantPart, fit_resonant_part
from rtctl.identification.noise.slow_noise import SlowPart, fit_slow_part, spectrum_of
from rtctl.identification.threads import each

HIGHEST_ORDER = 60
SLOW_ORDER = 500
"""Order of the autoregression that whitens a noise with a slow part; one of 1,000 is no better, one of 200 hardly
worse (chi-squared of a null: 178, of 20: 257, exactly: 174)."""
FINE_LENGTH = 4096
"""Length of a spectrum whose mean is the mean square."""
LONG_LENGTH = 2**16
"""Length of a spectrum that resolves lags of many samples."""
SAME_PERIOD_RATIO = 1.02
"""Ratio of two sample periods below which they count as the same."""


class NoiseModel(NamedTuple):
    """Autoregressive coefficients a (order,), the variance of w, and the slow part of w, for one sample period."""

    coefficients: FloatArray
    variance: float
    slow: SlowPart | None = None
    resonant: tuple[ResonantPart, ...] = ()
    """Resonant parts of w, behind the slow one."""
    period_s: float = 0.0
    """Sample period [s]; 0 where the model holds for any."""
    others: tuple[NoiseModel, ...] = ()
    """Models for other sample periods: an autoregression is one of samples, a sensor's noise one of seconds."""

    @property
    def parameters(self) -> int:
        """Number of values that describe its form, without its size."""
        own = (
            len(self.coefficients)
            + PARAMETERS * len(self.resonant)
            + (0 if self.slow is None else len(self.slow))
        )
        return own + sum(one.parameters for one in self.others)

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
        if self.slow is None:
            kernel = np.append(1.0, self.coefficients) / np.sqrt(self.variance or 1.0)
            begin = autoregression.first_rows_of(self.coefficients, self.variance or 1.0)
        else:
            kernel, begin = _whitener_beside_slow(self.coefficients.tobytes(), self.variance, self.slow)
        whitened = autoregression.whiten(series, kernel, begin)
        for part in self.resonant:
            whitened = part.whiten(whitened)
        return whitened

    @property
    def mean_square(self) -> float:
        """Mean square of the noise itself: of an autoregression exactly, of other parts by the sum of the power.

        That of a slow part grows with the length of what is looked at, here `FINE_LENGTH` samples.
        """
        if self.slow is None and not self.resonant:
            return autoregression.variance_of(self.coefficients, self.variance)
        length = LONG_LENGTH if self.slow is None else FINE_LENGTH
        power = self.power(length)
        # 0 and half the sample rate stand once among the frequencies, others twice
        return float((2.0 * power.sum() - power[0] - power[-1]) / length)

    def power(self, length: int) -> FloatArray:
        """Return the power (length // 2 + 1,) at the frequencies of a real FFT of `length`."""
        response = np.abs(rfft(np.append(1.0, self.coefficients), length)) ** 2
        density: FloatArray = self.variance / np.maximum(response, 1e-300)
        frequencies = np.arange(len(density)) / length
        for part in self.resonant:
            density = density * part.power(frequencies)
        return density if self.slow is None else density * self.slow.power(frequencies)


@lru_cache(maxsize=16)
def _whitener_beside_slow(
    coefficients: bytes, variance: float, slow: SlowPart
) -> tuple[FloatArray, FloatArray]:
    """Return the kernel and the first rows of the autoregression of order `SLOW_ORDER` that is like both parts."""
    power = NoiseModel(np.frombuffer(coefficients), variance, slow).power(LONG_LENGTH)
    correlation = irfft(power, LONG_LENGTH)[: SLOW_ORDER + 1]
    rows = autoregression.first_rows(correlation)
    return rows[-1, ::-1].copy(), rows[:-1, :-1].copy()


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
    series: Sequence[FloatArray],
    period_s: float,
    resonances: Sequence[Resonance],
    *,
    slow: bool,
    executor: Executor | None = None,
) -> NoiseModel:
    """Fit a noise model to residuals, with resonant parts and a slow one where the data show them.

    Args:
        series: One array (rows, n) a record. Its first row is the residual; the squares of the others restore what a
            projection removed from it.
        period_s: Sample period [s].
        resonances: Resonances of the device, at which a resonant part is looked for.
        slow: Whether to look for a slow part.
        executor: Takes the records in parallel; None: one after the other.
    """
    count = sum(one.shape[1] for one in series)
    model = _fit_rows(series, executor)
    if not model.variance > 0.0:
        return model
    for resonance in resonances:
        rivals = [model, *_with_peak(series, model, resonance, period_s, executor)]
        model = min(rivals, key=lambda one: _bic(one, count))
    if not slow:
        return model
    highest = limit_order([one.shape[1] for one in series])

    def slow_part(rows: Sequence[FloatArray]) -> tuple[FloatArray, float, SlowPart] | None:
        spectrum = spectrum_of(rows, executor)
        beside = np.ones(len(spectrum.frequency))
        for part in model.resonant:
            beside = beside * part.power(spectrum.frequency)
        return fit_slow_part(spectrum, count, highest, beside)

    # a constant of a record leaks into all frequencies as 1/f^2 does: a slow noise is there without it as well
    is_slow = slow_part(each(executor, _about_mean, series)) is not None
    found = slow_part(series) if is_slow else None
    if found is None:
        return model
    model = NoiseModel(*found, resonant=model.resonant)
    # less is left than the spectrum says: a periodogram leaks
    left = sum(each(executor, lambda one: float(np.sum(model.whiten(one) ** 2)), series))
    return model._replace(variance=model.variance * left / count)


def _about_mean(rows: FloatArray) -> FloatArray:
    """Return rows (rows, n) less the mean of each."""
    found: FloatArray = rows - rows.mean(axis=1, keepdims=True)
    return found


def _fit_rows(series: Sequence[FloatArray], executor: Executor | None) -> NoiseModel:
    """Fit an autoregression to arrays (rows, n), whose squares add."""
    lengths = [one.shape[1] for one in series]
    highest = limit_order(lengths)
    correlation = np.sum(each(executor, lambda one: sum_lagged_products(one, highest), series), axis=0)
    return fit_autoregression(correlation, sum(lengths))


def _with_peak(
    series: Sequence[FloatArray],
    model: NoiseModel,
    resonance: Resonance,
    period_s: float,
    executor: Executor | None,
) -> Iterator[NoiseModel]:
    """Yield models with a resonant part: behind the autoregression, and before one that is fitted to what it leaves."""
    behind = fit_resonant_part(each(executor, model.whiten, series), resonance, period_s, executor)
    if behind is not None:
        part, variance = behind
        yield model._replace(resonant=(*model.resonant, part), variance=model.variance * variance)
    first = fit_resonant_part(series, resonance, period_s, executor)
    if first is not None and not model.resonant:
        whitened = each(executor, first[0].whiten, series)
        yield _fit_rows(whitened, executor)._replace(resonant=(first[0],))


def _bic(model: NoiseModel, count: int) -> float:
    """Return the BIC of a noise over `count` samples, its size included in the likelihood."""
    unknowns = len(model.coefficients) + PARAMETERS * len(model.resonant)
    return count * float(np.log(model.variance)) + unknowns * float(np.log(count))


def fit_autoregression(correlation: FloatArray, count: int) -> NoiseModel:
    """Fit an autoregression to sums of products (lags,) over `count` samples, with the order by BIC."""
    correlation = correlation / count
    if not correlation[0] > 0.0:
        return NoiseModel(np.empty(0), 0.0)
    coefficients, variance, _ = autoregression.likeliest(correlation, count)
    return NoiseModel(coefficients, variance)


def compute_coloured_gram(slopes: FloatArray, noise: NoiseModel) -> FloatArray:
    """Return J R J^T (p, p) for slopes J (p, n) and the noise's covariance R, by its power spectrum."""
    n = slopes.shape[1]
    length = int(next_fast_len(n + min(n, 4096), real=True))
    spectrum = rfft(slopes, length)
    weight = noise.power(length) / length
    weight[1 : (length + 1) // 2] *= 2.0
    gram: FloatArray = ((spectrum * weight) @ spectrum.conj().T).real
    return gram
