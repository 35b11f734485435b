"""The resonant part of a noise: what unmeasured noise of the drive, or of the base, does to a device with a resonance.

A reading has white noise of its own beside the device's answer to a force that nobody measured. No autoregression of a
useful order has both the narrow peak and the floor beside it. The answer is an autoregression of the second order with
the device's poles; floor and answer together are an autoregression with a moving average,

    S(f) = s (1 + r / |A(f)|^2) = v |C(f)|^2 / |A(f)|^2,   A = 1 + a_1 z^-1 + a_2 z^-2,

with C from a spectral factorisation. Frequency and width start from the device's and are fitted with r, for a device
that stiffens with its amplitude answers elsewhere.

Reference: P. Whittle, Arkiv foer Matematik 2 (1953) 423, for the likelihood of a spectrum; L. Ljung, System
Identification (1999), section 3.2, for the factorisation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.fft import rfft
from scipy.optimize import minimize
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray

WIDEST = 60.0
"""Bandwidths about the resonance outside which the spectrum is taken as flat."""
CELLS_A_BANDWIDTH = 4
"""Cells of the spectrum in one bandwidth; frequencies in one cell are taken together."""
MOST_SHIFT, MOST_STRETCH = 0.3, 10.0
"""How far the frequency (as a fraction) and the width (as a factor) may be from the device's."""
PARAMETERS = 3
"""Height, frequency and width."""
HIGHEST = 1e4
"""Highest peak over the floor: where there is no floor, the noise is an autoregression and needs no further part."""
PEAKS = (0.3, 3.0, 30.0)
"""Heights of the peak over the floor, of the power, at which fits start."""


class Resonance(NamedTuple):
    """A resonance of the device."""

    frequency_hz: float
    damping_ratio: float


class ResonantPart(NamedTuple):
    """Coefficients (2,) of A and C of a spectrum |C|^2 / |A|^2."""

    poles: FloatArray
    zeros: FloatArray

    def power(self, frequencies: FloatArray) -> FloatArray:
        """Return the power at `frequencies` in periods per sample, over that of the innovation."""
        return _square(self.zeros, frequencies) / _square(self.poles, frequencies)

    def whiten(self, series: FloatArray) -> FloatArray:
        """Return the innovations of `series` (..., n)."""
        found: FloatArray = lfilter(np.append(1.0, self.poles), np.append(1.0, self.zeros), series, axis=-1)
        return found


class _Spectrum(NamedTuple):
    """Periodograms in cells, each (cells,)."""

    frequency: FloatArray
    """Periods per sample."""
    power: FloatArray
    """Sum of the periodograms in a cell."""
    number: FloatArray
    """Number of values in that sum."""


def fit_resonant_part(
    series: Sequence[FloatArray], resonance: Resonance, period_s: float
) -> tuple[ResonantPart, float] | None:
    """Fit the resonant part of a noise.

    Args:
        series: One array (rows, n) a record, nearly white but for the peak; squares of all rows of a record add.
        resonance: Resonance of the device, from where the fit starts.
        period_s: Sample period [s].

    Returns:
        The part, and the variance of its innovation; None where the data show no peak by BIC, or cannot.
    """
    at, width = (
        resonance.frequency_hz * period_s,
        2.0 * resonance.damping_ratio * resonance.frequency_hz * period_s,
    )
    if not (0.0 < at < 0.45 and 0.0 < resonance.damping_ratio < 0.5):
        return None
    near, rest = _near(series, at, width)
    if near.number.sum() < 2.0 * CELLS_A_BANDWIDTH:
        return None

    def deviance(unknown: FloatArray) -> float:
        shape = _shape(unknown, at, resonance.damping_ratio, near.frequency)
        if shape is None:
            return math.inf
        floor = (np.sum(near.power / shape) + rest.power[0]) / (near.number.sum() + rest.number[0])
        return 2.0 * float(
            (near.number.sum() + rest.number[0]) * np.log(floor) + np.sum(near.number * np.log(shape))
        )

    starts = [np.array([math.log(peak), 0.0, 0.0]) for peak in PEAKS]
    best = min((minimize(deviance, one, method="Nelder-Mead", options={"maxfev": 150}) for one in starts),
               key=lambda found: found.fun)  # fmt: skip
    total = near.number.sum() + rest.number[0]
    flat = 2.0 * float(total * np.log((near.power.sum() + rest.power[0]) / total))
    if not flat - best.fun > PARAMETERS * math.log(total):
        return None
    return _factorised(best.x, at, resonance.damping_ratio, near, rest)


def _near(series: Sequence[FloatArray], at: float, width: float) -> tuple[_Spectrum, _Spectrum]:
    """Return the spectrum about a frequency in cells, and the rest as one cell."""
    low, high = max(at - WIDEST * width, 0.0), min(at + WIDEST * width, 0.5)
    cells = max(1, round((high - low) / width * CELLS_A_BANDWIDTH))
    power, count, frequency = np.zeros(cells), np.zeros(cells), np.zeros(cells)
    rest_power = rest_count = 0.0
    for rows in series:
        length = rows.shape[-1]
        spectrum = np.sum(np.abs(rfft(rows, axis=-1)) ** 2, axis=0)[1 : (length + 1) // 2] / length
        f = np.arange(1, len(spectrum) + 1) / length
        inside = (f >= low) & (f < high)
        cell = np.minimum(((f[inside] - low) / (high - low) * cells).astype(int), cells - 1)
        power += np.bincount(cell, spectrum[inside], cells)
        count += np.bincount(cell, None, cells)
        frequency += np.bincount(cell, f[inside], cells)
        rest_power += float(spectrum[~inside].sum())
        rest_count += float(np.count_nonzero(~inside))
    seen = count > 0.0
    near = _Spectrum(frequency[seen] / count[seen], power[seen], count[seen])
    return near, _Spectrum(np.zeros(1), np.array([rest_power]), np.array([rest_count]))


def _poles(unknown: FloatArray, at: float, ratio: float) -> FloatArray | None:
    """Return A's coefficients of [log height, shift, log stretch]; None where they are out of range."""
    height, shift, stretch = unknown
    if abs(shift) > MOST_SHIFT or abs(stretch) > math.log(MOST_STRETCH) or height > math.log(HIGHEST):
        return None
    zeta = min(ratio * math.exp(stretch), 0.9)
    angle = 2.0 * math.pi * at * (1.0 + shift)
    radius = math.exp(-zeta * angle)
    return np.array([-2.0 * radius * math.cos(angle * math.sqrt(1.0 - zeta * zeta)), radius * radius])


def _shape(unknown: FloatArray, at: float, ratio: float, frequencies: FloatArray) -> FloatArray | None:
    """Return 1 + r / |A|^2, the peak of r / |A|^2 being exp(unknown[0])."""
    poles = _poles(unknown, at, ratio)
    if poles is None:
        return None
    least = _square(poles, np.array([at * (1.0 + unknown[1])]))[0]
    made: FloatArray = 1.0 + math.exp(float(unknown[0])) * least / _square(poles, frequencies)
    return made


def _square(coefficients: FloatArray, frequencies: FloatArray) -> FloatArray:
    """Return |1 + a_1 z^-1 + a_2 z^-2|^2."""
    z = np.exp(-2j * np.pi * frequencies)
    made: FloatArray = np.abs(1.0 + coefficients[0] * z + coefficients[1] * z * z) ** 2
    return made


def _factorised(
    unknown: FloatArray, at: float, ratio: float, near: _Spectrum, rest: _Spectrum
) -> tuple[ResonantPart, float] | None:
    """Return |A|^2 + r as v |C|^2 with C stable, and the variance of the innovation."""
    poles, shape = _poles(unknown, at, ratio), _shape(unknown, at, ratio, near.frequency)
    if poles is None or shape is None:
        return None
    floor = (np.sum(near.power / shape) + rest.power[0]) / (near.number.sum() + rest.number[0])
    share = math.exp(float(unknown[0])) * _square(poles, np.array([at * (1.0 + unknown[1])]))[0]
    a_1, a_2 = poles
    ends = [a_2, a_1 * (1.0 + a_2), 1.0 + a_1 * a_1 + a_2 * a_2 + share]
    roots = np.roots([*ends, ends[1], ends[0]])
    inside = roots[np.argsort(np.abs(roots))][:2]
    if not np.abs(inside).max() < 1.0:
        return None
    zeros = np.real(np.array([-inside.sum(), inside.prod()]))
    return ResonantPart(poles, zeros), float(floor * a_2 / zeros[1])
