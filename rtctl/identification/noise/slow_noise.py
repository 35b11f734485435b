"""The slow part of a noise, whose power grows towards zero frequency (1/f) and which no autoregression reaches.

After whitening by an autoregression the unbalanced Haar details at blocks of 2^j samples are nearly uncorrelated, and
those of long blocks are larger than the others. The transform is orthonormal, so dividing each detail by its
standard deviation whitens a series of any length. The sizes are smoothed over the levels, as few details are long.

Reference: G. W. Wornell, Wavelet-based representations for the 1/f family of fractal processes, Proc. IEEE 81 (1993)
1428.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from rtctl.border.arrays import FloatArray

LEVELS = 40
"""Number of levels: enough for any record."""
LEVEL_STEP = 0.5
"""Standard deviation of the log variance from level to level; 1/f doubles it, a random walk quadruples it."""
SIGNIFICANCE = 0.3
"""Approximate chance that white noise looks as slow; the slow part that it is then given is small."""
ROUND_OFF_VARIANCE = 1e-6
"""Variance relative to white noise below which details were removed with the mean."""


class SlowPart(NamedTuple):
    """Variances (LEVELS,) of the details of blocks of 2^level samples, level 1 first; white noise has 1 in each."""

    variances: FloatArray

    def power(self, frequencies: FloatArray) -> FloatArray:
        """Return the power at `frequencies` in periods per sample, relative to white noise.

        At frequency 0 it is that of the lowest frequency given.
        """
        lowest = np.min(frequencies[frequencies > 0.0], initial=0.5)
        levels = -np.log2(np.maximum(frequencies, lowest))
        return np.exp(np.interp(levels, 1.5 + np.arange(LEVELS), np.log(self.variances)))

    def whiten(self, series: FloatArray) -> FloatArray:
        """Return `series` (..., n) with each detail divided by its standard deviation."""
        sums, counts = _build_pyramid(series)
        gains = 1.0 / np.sqrt(self.variances)
        found: FloatArray = gains[len(sums) - 1] * sums[-1] / counts[-1]
        for level in range(len(sums) - 2, -1, -1):
            rest = found - gains[level] * (sums[level + 1] / counts[level + 1])
            found = sums[level] * (gains[level] / counts[level])
            found[..., ::2] += rest
            found[..., 1::2] += rest[..., : found.shape[-1] // 2]
        return found


def fit_slow_part(squares: FloatArray, numbers: FloatArray) -> SlowPart | None:
    """Fit the variances to `squares` (LEVELS,), sums over `numbers` (LEVELS,) details.

    The logarithms of the variances are a random walk over the levels, with an error of sqrt(2 / number) each.

    Returns:
        The slow part, or None where white noise explains the details.
    """
    seen = (numbers > 0.0) & (squares > ROUND_OFF_VARIANCE * numbers)
    if not seen.any():
        return None
    raw = np.zeros(LEVELS)
    raw[seen] = np.log(squares[seen] / numbers[seen])
    unlike = float(np.sum(numbers[seen] * np.expm1(raw[seen]) - numbers[seen] * raw[seen]))
    if chi2.sf(unlike, int(seen.sum())) > SIGNIFICANCE:
        return None
    weight = np.where(seen, 0.5 * numbers, 0.0)
    steps = np.diff(np.eye(LEVELS), axis=0) / LEVEL_STEP
    smooth = np.linalg.solve(np.diag(weight) + steps.T @ steps, weight * raw)
    return SlowPart(np.exp(smooth))


def sum_by_level(series: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return sums of squared details over all rows of `series` (rows, n), and their numbers in a row, both (LEVELS,).

    The last level that is used is the mean.
    """
    squares, numbers = np.zeros(LEVELS), np.zeros(LEVELS)
    sums, counts = _build_pyramid(series)
    energy = [float(np.sum(one**2 / count)) for one, count in zip(sums, counts, strict=True)]
    for level in range(len(sums) - 1):
        squares[level] = max(energy[level] - energy[level + 1], 0.0)
        numbers[level] = sums[level].shape[-1] - sums[level + 1].shape[-1]
    squares[len(sums) - 1], numbers[len(sums) - 1] = energy[-1], 1.0
    return squares, numbers


def _build_pyramid(series: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return sums over blocks of 1, 2, 4 ... samples up to the whole, and how many samples each block has.

    The last block of each level is as long as there are samples.
    """
    sums, counts = [series], [np.ones(series.shape[-1])]
    while sums[-1].shape[-1] > 1:
        sums.append(_sum_pairs(sums[-1]))
        counts.append(_sum_pairs(counts[-1]))
    return sums, counts


def _sum_pairs(series: FloatArray) -> FloatArray:
    """Return the sums of neighbouring pairs of (..., n); the last value alone where n is odd."""
    both = series.shape[-1] // 2
    found = np.empty((*series.shape[:-1], series.shape[-1] - both))
    np.add(series[..., : 2 * both : 2], series[..., 1::2], out=found[..., :both])
    found[..., both:] = series[..., 2 * both :]
    return found
