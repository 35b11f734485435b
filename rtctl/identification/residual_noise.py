"""What is left after a fit as coloured noise: an autoregression, to whiten with and to state honest errors by.

    e_t + a_1 e_{t-1} + ... + a_m e_{t-m} = w_t,   w white

by Yule-Walker and Levinson over all records at once, the order by BIC. Treating coloured residuals as white makes
every interval too short (often many times).

Reference: J. Durbin, The fitting of time-series models (1960).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]
HIGHEST_ORDER = 60


class NoiseModel(NamedTuple):
    """Coefficients a (order,) and the variance of w."""

    coefficients: FloatArray
    variance: float

    def whiten(self, series: FloatArray) -> FloatArray:
        """w of the series (..., n), before the first sample taken as zero; standardised to variance 1."""
        filtered: FloatArray = lfilter(np.append(1.0, self.coefficients), np.ones(1), series, axis=-1)
        whitened: FloatArray = filtered / np.sqrt(self.variance or 1.0)
        return whitened

    def power(self, length: int) -> FloatArray:
        """Power (length // 2 + 1,) at the frequencies of a real FFT of `length`; white noise: its variance."""
        response = np.abs(rfft(np.append(1.0, self.coefficients), length)) ** 2
        density: FloatArray = self.variance / np.maximum(response, 1e-300)
        return density


def fit_noise(series: Sequence[FloatArray], highest_order: int = HIGHEST_ORDER) -> NoiseModel:
    """Of residuals, one array (n,) a record. Constant zero gives variance 0."""
    count = sum(len(one) for one in series)
    highest = max(0, min(highest_order, count // 20, min(len(one) for one in series) - 1))
    correlation = np.sum([_autocorrelation(one, highest) for one in series], axis=0) / count
    if not correlation[0] > 0.0:
        return NoiseModel(np.empty(0), 0.0)
    best, best_bic = NoiseModel(np.empty(0), float(correlation[0])), count * np.log(correlation[0])
    a, variance = np.empty(0), float(correlation[0])
    for order in range(1, highest + 1):
        reflection = -(correlation[order] + a @ correlation[order - 1 : 0 : -1]) / variance
        a = np.append(a + reflection * a[::-1], reflection)
        variance *= 1.0 - reflection**2
        if not variance > 0.0:
            break
        bic = count * np.log(variance) + order * np.log(count)
        if bic < best_bic:
            best, best_bic = NoiseModel(a, float(variance)), bic
    return best


def coloured_gram(slopes: FloatArray, noise: NoiseModel) -> FloatArray:
    """J R J^T (p, p) for slopes J (p, n) and the noise's covariance R, by its power spectrum."""
    n = slopes.shape[1]
    length = int(next_fast_len(n + min(n, 4096), real=True))
    spectrum = rfft(slopes, length)
    weight = noise.power(length) / length
    weight[1 : (length + 1) // 2] *= 2.0
    gram: FloatArray = ((spectrum * weight) @ spectrum.conj().T).real
    return gram


def _autocorrelation(series: FloatArray, highest: int) -> FloatArray:
    length = int(next_fast_len(len(series) + highest, real=True))
    power = np.abs(rfft(series, length)) ** 2
    found: FloatArray = irfft(power, length)[: highest + 1]
    return found
