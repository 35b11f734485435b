"""Autoregressions from autocorrelations: Levinson's recursion, the order by BIC, and exact whitening of any length.

References: J. Durbin, Rev. Int. Stat. Inst. 28 (1960) 233; P. Whittle, Biometrika 50 (1963) 129.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray

ROWS_AT_ONCE = 16
"""Rows transformed at once: limits memory, and they stay in the processor's cache."""
MAX_DIRECT_ORDER = 10
"""Highest order that is filtered sample by sample; above it FFTs are used."""


def predictors(correlation: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    """Yield the coefficients (order,) and the variance of what they leave, order 0, 1, ..., of a correlation (lags,).

    They end where nothing is left.
    """
    a, variance = np.empty(0), float(correlation[0])
    yield a, variance
    for order in range(1, len(correlation)):
        reflection = -(correlation[order] + a @ correlation[order - 1 : 0 : -1]) / variance
        a = np.append(a + reflection * a[::-1], reflection)
        variance *= 1.0 - reflection**2
        if not variance > 0.0:
            return
        yield a, float(variance)


def likeliest(correlation: FloatArray, count: int) -> tuple[FloatArray, float, float]:
    """Return coefficients, variance and BIC of the order of least BIC, of a mean correlation > 0 of `count` samples."""
    best: tuple[FloatArray, float, float] | None = None
    for a, variance in predictors(correlation):
        bic = count * float(np.log(variance)) + len(a) * float(np.log(count))
        if best is None or bic < best[2]:
            best = a, variance, bic
    assert best is not None
    return best


def first_rows(correlation: FloatArray) -> FloatArray:
    """Return the triangle (orders, orders) that whitens a record's first samples, of all orders up to their number.

    There are as many orders as lags, fewer where nothing is left beyond them.
    """
    made = list(predictors(correlation))
    triangle = np.zeros((len(made), len(made)))
    for order, (a, variance) in enumerate(made):
        triangle[order, : order + 1] = np.append(a[::-1], 1.0) / np.sqrt(variance)
    return triangle


def first_rows_of(coefficients: FloatArray, variance: float) -> FloatArray:
    """Return `first_rows` (m, m) of an autoregression of order m, whose predictors of lower order are derived from it.

    Raises:
        ValueError: It is not stable.
    """
    a = coefficients
    triangle = np.zeros((len(a), len(a)))
    for order in range(len(a) - 1, -1, -1):  # Levinson's recursion backwards
        reflection = a[-1]
        left = 1.0 - reflection**2
        if not left > 0.0:
            raise ValueError(f"the autoregression {coefficients!r} is not stable")
        variance = variance / left
        a = (a[:-1] - reflection * a[-2::-1]) / left
        triangle[order, : order + 1] = np.append(a[::-1], 1.0) / np.sqrt(variance)
    return triangle


def variance_of(coefficients: FloatArray, variance: float) -> float:
    """Return the variance of the series of a stable autoregression, whose innovations have `variance`.

    Raises:
        ValueError: It is not stable.
    """
    if not len(coefficients) or variance == 0.0:
        return variance
    whitens_first = float(first_rows_of(coefficients, variance)[0, 0])  # one over its own size
    return whitens_first**-2


def whiten(series: FloatArray, kernel: FloatArray, begin: FloatArray) -> FloatArray:
    """Return `series` (..., n) behind `kernel` (1 + m,), its first m samples by the triangle `begin` (m, m)."""
    if len(kernel) - 1 <= MAX_DIRECT_ORDER:
        whitened: FloatArray = lfilter(kernel, np.ones(1), series, axis=-1)
    else:
        whitened = _filter_by_fft(kernel, series)
    first = min(len(begin), series.shape[-1])
    whitened[..., :first] = series[..., :first] @ begin[:first, :first].T
    return whitened


def sum_lagged_products(series: FloatArray, highest: int) -> FloatArray:
    """Return sums of products (highest + 1,) at lags from 0 of a series (n,), or of several (rows, n) together."""
    rows = np.atleast_2d(series)
    length = int(next_fast_len(rows.shape[1] + highest, real=True))
    found: FloatArray = irfft(sum_spectra(rows, length), length)[: highest + 1]
    return found


def sum_spectra(rows: FloatArray, length: int) -> FloatArray:
    """Return the sum of squares (length // 2 + 1,) of the FFTs, padded to `length`, of rows (rows, n)."""
    power = np.zeros(length // 2 + 1)
    for begin in range(0, len(rows), ROWS_AT_ONCE):
        spectrum = rfft(rows[begin : begin + ROWS_AT_ONCE], length)
        power += np.sum(spectrum.real**2 + spectrum.imag**2, axis=0)
    return power


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
