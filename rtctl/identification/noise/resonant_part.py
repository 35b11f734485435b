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
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np
from scipy.fft import rfft
from scipy.optimize import minimize
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.identification.threads import each

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


class Spectrum(NamedTuple):
    """Periodograms in cells, each (cells,)."""

    frequency: FloatArray
    """Periods per sample."""
    power: FloatArray
    """Sum of the periodograms in a cell."""
    number: FloatArray
    """Number of values in that sum."""


def fit_resonant_part(
    series: Sequence[FloatArray], resonance: Resonance, period_s: float, executor: Executor | None = None
) -> tuple[ResonantPart, float] | None:
    """Fit the resonant part of a noise.

    Args:
        series: One array (rows, n) a record, nearly white but for the peak; squares of all rows of a record add.
        resonance: Resonance of the device, from where the fit starts.
        period_s: Sample period [s].
        executor: Takes the records in parallel; None: one after the other.

    Returns:
        The part, and the variance of its innovation; None where the data show no peak by BIC, or cannot.
    """
    at, width = (
        resonance.frequency_hz * period_s,
        2.0 * resonance.damping_ratio * resonance.frequency_hz * period_s,
    )
    if not (0.0 < at < 0.45 and 0.0 < resonance.damping_ratio < 0.5):
        return None
    near, rest = _near(each(executor, _periodogram, series), at, width)
    if near.number.sum() < 2.0 * CELLS_A_BANDWIDTH:
        return None

    half = math.pi * near.frequency
    known = (
        at, resonance.damping_ratio, np.sin(half), np.cos(half), near.power, near.number,
        float(rest.power[0]), float(rest.number[0]),
    )  # fmt: skip
    starts = [np.array([math.log(peak), 0.0, 0.0]) for peak in PEAKS]
    best = min((minimize(deviance, one, known, method="Nelder-Mead", options={"maxfev": 150}) for one in starts),
               key=lambda found: found.fun)  # fmt: skip
    total = near.number.sum() + rest.number[0]
    flat = 2.0 * float(total * np.log((near.power.sum() + rest.power[0]) / total))
    if not flat - best.fun > PARAMETERS * math.log(total):
        return None
    return _factorised(best.x, at, resonance.damping_ratio, near, rest)


def _periodogram(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return frequencies between zero and half the sample rate, and the sum of the periodograms of rows (rows, n)."""
    length = rows.shape[-1]
    power = np.sum(np.abs(rfft(rows, axis=-1)) ** 2, axis=0)[1 : (length + 1) // 2] / length
    return np.arange(1, len(power) + 1) / length, power


def _near(
    periodograms: Sequence[tuple[FloatArray, FloatArray]], at: float, width: float
) -> tuple[Spectrum, Spectrum]:
    """Return the spectrum about a frequency in cells, and the rest as one cell."""
    low, high = max(at - WIDEST * width, 0.0), min(at + WIDEST * width, 0.5)
    cells = max(1, round((high - low) / width * CELLS_A_BANDWIDTH))
    power, count, frequency = np.zeros(cells), np.zeros(cells), np.zeros(cells)
    rest_power = rest_count = 0.0
    for f, spectrum in periodograms:
        inside = (f >= low) & (f < high)
        cell = np.minimum(((f[inside] - low) / (high - low) * cells).astype(int), cells - 1)
        power += np.bincount(cell, spectrum[inside], cells)
        count += np.bincount(cell, None, cells)
        frequency += np.bincount(cell, f[inside], cells)
        rest_power += float(spectrum[~inside].sum())
        rest_count += float(np.count_nonzero(~inside))
    seen = count > 0.0
    near = Spectrum(frequency[seen] / count[seen], power[seen], count[seen])
    return near, Spectrum(np.zeros(1), np.array([rest_power]), np.array([rest_count]))


# 9 parameters because a kernel takes its arrays one by one
@kernel
def deviance(  # noqa: PLR0913
    unknown: FloatArray, at: float, ratio: float, sines: FloatArray, cosines: FloatArray,
    power: FloatArray, number: FloatArray, rest_power: float, rest_number: float,
) -> float:  # fmt: skip
    """Return Whittle's deviance of [log height, shift, log stretch] with the best floor; infinite out of range.

    It is that of `shape`, of which |A|^2 is written by its pair of poles rho e^(+-i theta), without cancellation:

        |A|^2 = ((1 - rho)^2 + 4 rho sin^2((w - theta) / 2)) ((1 - rho)^2 + 4 rho sin^2((w + theta) / 2))

    Args:
        unknown: (3,).
        at: Frequency of the device's resonance [periods a sample].
        ratio: Its damping ratio.
        sines: sin(w / 2) of the cells.
        cosines: cos(w / 2) of the cells.
        power: Their sums of periodograms.
        number: Their numbers of values.
        rest_power: Sum of the periodograms elsewhere, where the spectrum is flat.
        rest_number: Number of values there.
    """
    radius, angle = pole(unknown[1], unknown[2], at, ratio)
    if not radius > 0.0 or unknown[0] > math.log(HIGHEST):
        return math.inf
    middle = math.pi * at * (1.0 + unknown[1])
    sine, cosine = math.sin(0.5 * angle), math.cos(0.5 * angle)
    height = math.exp(unknown[0]) * _square_of_pair(radius, sine, cosine, math.sin(middle), math.cos(middle))
    over_floor, logarithms, count = rest_power, 0.0, rest_number
    for k in range(power.size):
        one = 1.0 + height / _square_of_pair(radius, sine, cosine, sines[k], cosines[k])
        over_floor += power[k] / one
        logarithms += number[k] * math.log(one)
        count += number[k]
    return 2.0 * (count * math.log(over_floor / count) + logarithms)


@kernel
def pole(shift: float, stretch: float, at: float, ratio: float) -> tuple[float, float]:
    """Return radius and angle of the poles of a shifted and stretched resonance; a radius of 0 out of range."""
    if abs(shift) > MOST_SHIFT or abs(stretch) > math.log(MOST_STRETCH):
        return 0.0, 0.0
    zeta = min(ratio * math.exp(stretch), 0.9)
    angle = 2.0 * math.pi * at * (1.0 + shift)
    return math.exp(-zeta * angle), angle * math.sqrt(1.0 - zeta * zeta)


@kernel
def _square_of_pair(radius: float, sine: float, cosine: float, at_sine: float, at_cosine: float) -> float:
    """Return |A|^2 at w of a pair of poles, by sine and cosine of half their angle, and of w / 2."""
    left, right = at_sine * cosine - at_cosine * sine, at_sine * cosine + at_cosine * sine
    gap = (1.0 - radius) * (1.0 - radius)
    return (gap + 4.0 * radius * left * left) * (gap + 4.0 * radius * right * right)


def shape(unknown: FloatArray, at: float, ratio: float, frequencies: FloatArray) -> FloatArray:
    """Return 1 + r / |A|^2 (n,) of [log height, shift, log stretch], the peak of r / |A|^2 being exp(unknown[0])."""
    poles = _coefficients(unknown, at, ratio)
    least = _square(poles, np.array([at * (1.0 + unknown[1])]))[0]
    made: FloatArray = 1.0 + math.exp(float(unknown[0])) * least / _square(poles, frequencies)
    return made


def _coefficients(unknown: FloatArray, at: float, ratio: float) -> FloatArray:
    """Return A's coefficients (2,)."""
    radius, angle = pole(float(unknown[1]), float(unknown[2]), at, ratio)
    return np.array([-2.0 * radius * math.cos(angle), radius * radius])


def _square(coefficients: FloatArray, frequencies: FloatArray) -> FloatArray:
    """Return |1 + a_1 z^-1 + a_2 z^-2|^2."""
    z = np.exp(-2j * np.pi * frequencies)
    made: FloatArray = np.abs(1.0 + coefficients[0] * z + coefficients[1] * z * z) ** 2
    return made


def _factorised(
    unknown: FloatArray, at: float, ratio: float, near: Spectrum, rest: Spectrum
) -> tuple[ResonantPart, float] | None:
    """Return |A|^2 + r as v |C|^2 with C stable, and the variance of the innovation."""
    poles = _coefficients(unknown, at, ratio)
    over_floor = near.power / shape(unknown, at, ratio, near.frequency)
    floor = (np.sum(over_floor) + rest.power[0]) / (near.number.sum() + rest.number[0])
    share = math.exp(float(unknown[0])) * _square(poles, np.array([at * (1.0 + unknown[1])]))[0]
    a_1, a_2 = poles
    ends = [a_2, a_1 * (1.0 + a_2), 1.0 + a_1 * a_1 + a_2 * a_2 + share]
    roots = np.roots([*ends, ends[1], ends[0]])
    inside = roots[np.argsort(np.abs(roots))][:2]
    if not np.abs(inside).max() < 1.0:
        return None
    zeros = np.real(np.array([-inside.sum(), inside.prod()]))
    return ResonantPart(poles, zeros), float(floor * a_2 / zeros[1])
