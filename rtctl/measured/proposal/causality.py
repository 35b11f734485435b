"""Which of two signals leads: the impulse response from an input to an output has no part before zero.

h = irfft(S_ab / S_aa), Welch's spectra; from cause to effect its energy lies at lags >= 0, in the other direction (an
inverse, which differentiates) on both sides of zero. Reference: L. Ljung, System Identification, 1999, section 6.4.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray

LONGEST = 1 << 16
"""Samples that are looked at."""
SEGMENT = 2048
FEWEST = 256
LEAST_MARGIN = 0.15
"""Difference of the two shares of energy at lags >= 0 from which one signal leads."""
LEAST_SHARE = 0.65
"""Least share of energy at lags >= 0 from the signal that leads."""
_FLOOR = 1e-4
"""Power, relative to the largest, below which a frequency says nothing."""
LEAST_BAND = 0.02
"""Share of frequencies that must be excited: a single tone has no direction."""


def leads(one: FloatArray, other: FloatArray) -> int:
    """Return 1 where `one` (n,) leads `other` (n,), -1 where it follows, 0 where that does not show."""
    there, back = causal_share(one, other), causal_share(other, one)
    if max(there, back) < LEAST_SHARE or abs(there - back) < LEAST_MARGIN:
        return 0
    return 1 if there > back else -1


def causal_share(cause: FloatArray, effect: FloatArray) -> float:
    """Return the share of the impulse response's energy at lags >= 0; 0.0 where the cause has too few frequencies."""
    from scipy.signal import csd, welch

    count = min(len(cause), LONGEST)
    a, b = cause[:count], effect[:count]
    if count < FEWEST or not (np.isfinite(a).all() and np.isfinite(b).all()):
        return 0.0
    length = min(SEGMENT, 1 << (count // 2).bit_length() - 1)
    _, power = welch(a, nperseg=length)
    _, cross = csd(a, b, nperseg=length)
    excited = power > _FLOOR * power.max()
    if power.max() <= 0.0 or excited.mean() < LEAST_BAND:
        return 0.0
    response = np.fft.irfft(np.where(excited, cross / np.where(excited, power, 1.0), 0.0), n=length)
    energy = np.square(response)
    half = length // 2
    at_zero = energy[0]
    late, early = float(energy[1:half].sum()), float(energy[half:].sum())
    total = late + early + at_zero
    return (late + 0.5 * at_zero) / total if total > 0.0 else 0.0
