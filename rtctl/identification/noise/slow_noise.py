"""The slow part of a noise, whose power grows towards zero frequency (1/f) and which no short autoregression reaches.

    S(f) = s(f) (1 + (corner / f)^exponent),   s the power of an autoregression

Corner and exponent are the likeliest of a grid, each with the autoregression that suits it best, by Whittle's
likelihood; its two numbers are paid for as BIC does. Unlike a free size for each octave, a law that holds from octave
to octave is known from those that a fit leaves alone.

References: P. Whittle, Arkiv foer Matematik 2 (1953) 423; F. N. Hooge, IEEE Trans. Electron Devices 41 (1994) 1926, for
exponents about 1; a random walk has 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np
from scipy.fft import next_fast_len

from rtctl.border.arrays import FloatArray
from rtctl.identification.noise.autoregression import likeliest, sum_spectra
from rtctl.identification.threads import each

EXPONENTS = (0.7, 1.0, 1.4, 2.0)
CORNERS_AN_OCTAVE = 2
UNKNOWNS = 2
"""Corner and exponent."""
WIDEST_CELL = 0.002
"""Width of a cell of the spectrum [periods per sample]: an autoregression of order 60 turns an eighth in it."""
CELL_GROWTH = 0.05
"""Width of a cell over its frequency, at least one value of the spectrum."""


class SlowPart(NamedTuple):
    """A power 1 + (corner / f)^exponent at f periods per sample."""

    corner: float
    """Frequency at which it is as large as the rest [periods per sample]."""
    exponent: float

    def power(self, frequencies: FloatArray) -> FloatArray:
        """Return the power at `frequencies` in periods per sample, relative to the rest of the noise.

        At frequency 0 it is that of the lowest frequency given.
        """
        lowest = np.min(frequencies[frequencies > 0.0], initial=0.5)
        found: FloatArray = 1.0 + (self.corner / np.maximum(frequencies, lowest)) ** self.exponent
        return found


class Spectrum(NamedTuple):
    """Mean periodogram of a noise in cells (cells,) from zero frequency to half the sample rate."""

    frequency: FloatArray
    """Periods per sample."""
    power: FloatArray
    share: FloatArray
    """Share of all frequencies that are in the cell."""
    lowest: float
    """Lowest frequency of the longest record [periods per sample]."""

    def correlation(self, lags: int) -> FloatArray:
        """Return the autocorrelation (1 + lags,)."""
        turns = np.cos(2.0 * np.pi * np.outer(np.arange(lags + 1), self.frequency))
        found: FloatArray = turns @ (self.share * self.power)
        return found


def spectrum_of(series: Sequence[FloatArray], executor: Executor | None = None) -> Spectrum:
    """Return the spectrum of records (rows, n), whose rows' squares add."""
    longest = max(one.shape[1] for one in series)
    length = int(next_fast_len(2 * longest, real=True))
    spectra = each(executor, lambda rows: sum_spectra(rows, length), series)
    power = np.sum(spectra, axis=0) / sum(one.shape[1] for one in series)
    weight = np.full(len(power), 2.0)
    weight[0] = 1.0
    weight[-1] = 2.0 if length % 2 else 1.0
    first = _first_of_cells(len(power), length)
    share = np.add.reduceat(weight, first)
    return Spectrum(
        frequency=np.add.reduceat(weight * np.arange(len(power)), first) / share / length,
        power=np.add.reduceat(weight * power, first) / share,
        share=share / length,
        lowest=1.0 / longest,
    )


def fit_slow_part(
    spectrum: Spectrum, count: int, highest: int, beside: FloatArray
) -> tuple[FloatArray, float, SlowPart] | None:
    """Fit an autoregression with a slow part.

    Args:
        spectrum: That of the noise.
        count: Number of samples.
        highest: Highest order of the autoregression.
        beside: Power (cells,) of further parts of the noise, which stay as they are.

    Returns:
        Coefficients and variance of the autoregression and the slow part; None where the noise has none.
    """

    def fitted(shape: FloatArray) -> tuple[FloatArray, float, float]:
        left = spectrum._replace(power=spectrum.power / (beside * shape))
        a, variance, bic = likeliest(left.correlation(highest), count)
        return a, variance, bic + count * float(spectrum.share @ np.log(shape))

    if not spectrum.power.any():
        return None
    *_, least = fitted(np.ones(len(spectrum.power)))
    least -= UNKNOWNS * float(np.log(count))
    found = None
    frequency = np.maximum(spectrum.frequency, 0.5 * spectrum.lowest)
    for slow in _grid(spectrum.lowest):
        a, variance, bic = fitted(slow.power(frequency))
        if bic < least:
            found, least = (a, variance, slow), bic
    return found


def _grid(lowest: float) -> list[SlowPart]:
    """Return the slow parts that are tried; `lowest` [periods per sample]."""
    octaves = max(0.0, np.log2(0.25 / lowest))
    corners = 0.25 * 2.0 ** (-np.arange(int(octaves * CORNERS_AN_OCTAVE) + 1) / CORNERS_AN_OCTAVE)
    return [SlowPart(float(corner), exponent) for exponent in EXPONENTS for corner in corners]


def _first_of_cells(values: int, length: int) -> list[int]:
    """Return the first of the values of a spectrum in each cell; zero frequency has one of its own."""
    first, at = [0], 1
    while at < values:
        first.append(at)
        at += max(1, int(min(CELL_GROWTH * at, WIDEST_CELL * length)))
    return first
