"""Elementary functions of a law in arithmetic alone, so that the compiler works on several lanes at once.

2^y = 2^n e^r,   n = round(y), r = (y - n) ln 2, e^r by Taylor's polynomial of order 10
x^e = 2^(e log2 x),   x = 2^n m, sqrt(1/2) <= m < sqrt(2), log m = 2 atanh((m - 1) / (m + 1)) by its series

The exponent n is written into the bits of the result, and read from those of x (IEEE 754 binary64). All are off by
1e-12 at most. The libraries' functions, one lane at a time, take several times as long and keep all that stands beside
them from being done for several lanes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_sim.oscillator.equation.binding import law

FARTHEST = 40.0
"""Exponent beyond which exp(-x) is nothing beside 1."""
LN_2 = 0.6931471805599453
LARGEST_POWER_OF_2 = 1000.0
EXPONENT_PLACE = np.uint64(52)
"""Place of the exponent's lowest bit."""
ONE_BITS, SQRT_HALF_BITS = np.uint64(0x3FF0000000000000), np.uint64(0x3FE6A09E667F3BCD)
"""Bits of 1 and of sqrt(1/2)."""
WHOLE = 6755399441055744.0
"""1.5 * 2^52: what is added to it becomes a whole number, in its lowest bits."""
WHOLE_BITS = np.uint64(0x4338000000000000 - 1023)
"""Its bits, less the exponent's bias."""


@law
def two_to(y: float) -> Any:
    """Return 2^y; 2^+-1000 for what is beyond."""
    within = min(max(y, -LARGEST_POWER_OF_2), LARGEST_POWER_OF_2)
    whole = within + WHOLE
    r = LN_2 * (within - (whole - WHOLE))
    r2 = r * r
    r4 = r2 * r2
    first, middle = (
        (1.0 + r) + r2 * (1 / 2 + r * (1 / 6)),
        (1 / 24 + r * (1 / 120)) + r2 * (1 / 720 + r * (1 / 5040)),
    )
    factor = first + r4 * (middle + r4 * ((1 / 40320 + r * (1 / 362880)) + r2 * (1 / 3628800)))
    bits = np.float64(factor).view(np.uint64) + (np.float64(whole).view(np.uint64) << EXPONENT_PLACE)
    return np.uint64(bits).view(np.float64)


@law
def power(x: float, e: float) -> Any:
    """Return x^e for 0 <= x < inf; 2^(-1023 e) where x is 0."""
    bits = np.float64(x).view(np.uint64)
    biased = (bits - SQRT_HALF_BITS + ONE_BITS) >> EXPONENT_PLACE
    m = np.uint64(bits - (biased << EXPONENT_PLACE) + ONE_BITS).view(np.float64)
    exponent = np.uint64(biased + WHOLE_BITS).view(np.float64) - WHOLE
    s = (m - 1.0) / (m + 1.0)
    s2 = s * s
    s4 = s2 * s2
    low, high = (1 / 3 + s2 * (1 / 5)) + s4 * (1 / 7 + s2 * (1 / 9)), (1 / 11 + s2 * (1 / 13)) + s4 * (1 / 15)
    return two_to(e * (exponent + (2.0 / LN_2) * s * (1.0 + s2 * (low + s4 * s4 * high))))


@law
def fading(x: float) -> Any:
    """Return exp(-x) for x >= 0."""
    return two_to(min(x, FARTHEST) * (-1.0 / LN_2))


@law
def soft_sign(x: float) -> Any:
    """Return tanh x."""
    e = fading(2.0 * abs(x))
    size = (1.0 - e) / (1.0 + e)
    return size if x > 0.0 else -size
